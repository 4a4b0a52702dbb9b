// Twin of `src/drive/path.rs`: the path that is followed, in the frame of its samples, and the car's place relative to it.
// The constants ROWS_AHEAD, CELLS_AHEAD, BLENDS, HAS_RELIEF and RELIEF_AT are generated.

// Three vectors for each row of the path: the figures of `PathRow` in its order. From RELIEF_AT on, on roads that are not
// level and dry, two more for each row: gravity along, across and square to the road, and the curvature square to it; then the friction
// and what it gains per metre to the left.
@group(0) @binding(4) var<storage, read> path: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> plans: array<f32>;
@group(0) @binding(6) var<storage, read> courses: array<Course>;

// Figures of a whole line; twin of `Course` in `src/drive/road.rs`.
struct Course {
    path_at: f32,
    rows: f32,
    spacing: f32,
    per_metre: f32,
    begin_row: f32,
    begin_along: f32,
    begin_x: f32,
    begin_y: f32,
    begin_yaw: f32,
    plan_at: f32,
    plan_stride: f32,
    cells_per_metre: f32,
    most_steps: f32,
}

struct PathRow {
    curvature: f32,
    slope: f32,
    next_x: f32,
    next_y: f32,
    turn: f32,
    left: f32,
    left_rise: f32,
    right: f32,
    right_rise: f32,
    cell: f32,
    cell_share: f32,
    flap: f32,
}

struct Pose {
    row: f32,
    lap: f32,
    along: f32,
    x: f32,
    y: f32,
    yaw: f32,
}

struct View {
    row: PathRow,
    pose: Pose,
    passed: bool,
    offset: f32,
    heading_error: f32,
    bend: f32,
    beyond: f32,
}

// An index of a table, from a whole number. The binding prevents reads beyond the end of the table.
fn place_of_number(number: f32) -> u32 {
    return u32(min(max(number, 0.0), 16777215.0));
}

// `Lookup::whole`.
fn whole(x: f32, most: f32) -> f32 {
    return floor(min(max(x, 0.0), most));
}

fn path_row(number: f32) -> PathRow {
    let at = 3u * place_of_number(number);
    let a = path[at];
    let b = path[at + 1u];
    let c = path[at + 2u];
    return PathRow(a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x, c.y, c.z, c.w);
}

// The path `along` metres behind the sample of `row`: `frame_at` and `resolve` in one, because both take sines of the same
// angles.
struct Sight {
    heading: f32,
    curvature: f32,
    // Distance of the car ahead of the path's frame and to its left.
    ahead: f32,
    left: f32,
}

fn sight(row: PathRow, pose: Pose) -> Sight {
    let half_slope = 0.5 * row.slope;
    let s = vec4<f32>(
        0.1127016653792583 * pose.along,
        0.5 * pose.along,
        0.8872983346207417 * pose.along,
        pose.along,
    );
    let angle = s * (row.curvature + half_slope * s);
    let cosine = cos_of_four(angle);
    let sine = sin_of_four(angle);
    var x = 0.2777777777777778 * cosine.x;
    x = x + 0.4444444444444444 * cosine.y;
    x = x + 0.2777777777777778 * cosine.z;
    var y = 0.2777777777777778 * sine.x;
    y = y + 0.4444444444444444 * sine.y;
    y = y + 0.2777777777777778 * sine.z;
    let away_x = pose.x - x * pose.along;
    let away_y = pose.y - y * pose.along;
    return Sight(
        angle.w,
        row.curvature + row.slope * pose.along,
        away_x * cosine.w + away_y * sine.w,
        away_y * cosine.w - away_x * sine.w,
    );
}

fn nearer(row: PathRow, pose: Pose) -> f32 {
    let seen = sight(row, pose);
    let stretch = max(1.0 - seen.curvature * seen.left, 0.2);
    return pose.along + min(max(seen.ahead / stretch, -10.0), 10.0);
}

fn look(course: Course, before: Pose) -> View {
    var row = path_row(course.path_at + before.row);
    let along = nearer(row, before);
    var pose = before;
    pose.along = along;
    let stays = along < course.spacing;
    if !stays {
        let x = before.x - row.next_x;
        let y = before.y - row.next_y;
        let cosine = own_cos(Wheels(row.turn)).x;
        let sine = own_sin(Wheels(row.turn)).x;
        let after = before.row + 1.0;
        let ends = !(after < course.rows);
        pose.row = select(after, 0.0, ends);
        pose.lap = select(before.lap, before.lap + 1.0, ends);
        pose.along = along - course.spacing;
        pose.x = x * cosine + y * sine;
        pose.y = y * cosine - x * sine;
        pose.yaw = before.yaw - row.turn;
        row = path_row(course.path_at + pose.row);
    }
    pose.along = nearer(row, pose);
    let seen = sight(row, pose);
    let share = pose.along * course.per_metre;
    let left = row.left + share * row.left_rise;
    let right = row.right + share * row.right_rise;
    return View(
        row,
        pose,
        !stays,
        seen.left,
        pose.yaw - seen.heading,
        seen.curvature,
        max(seen.left - left, -(seen.left + right)),
    );
}

// The road under a car; twin of `Footing` in `src/drive/relief.rs`.
struct Footing {
    climb: f32,
    lean: f32,
    load: f32,
    friction: f32,
}

fn footing(course: Course, view: View, speed: f32) -> Footing {
    let at = RELIEF_AT + 2u * place_of_number(course.path_at + view.pose.row);
    let share = view.pose.along * course.per_metre;
    let here = path[at];
    let row = here + share * (path[at + 2u] - here);
    let friction = path[at + 1u].xy + share * (path[at + 3u].xy - path[at + 1u].xy);
    let load = row.z + speed * speed * row.w;
    return Footing(
        row.x + view.heading_error * row.y,
        row.y - view.heading_error * row.x,
        max(load, 0.5),
        max(friction.x + view.offset * friction.y, 0.05),
    );
}

fn curvature_ahead(course: Course, pose: Pose, ahead: f32) -> f32 {
    let distance = pose.along + ahead;
    let rows = whole(distance * course.per_metre, ROWS_AHEAD);
    let past = distance - rows * course.spacing;
    let row = path[3u * place_of_number(course.path_at + pose.row + rows)];
    return row.x + row.y * past;
}
