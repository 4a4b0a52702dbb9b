//! Particles in blocks of lanes, and how they move. Twin of `shaders/swarm.wgsl`, with the same operations. The kernel puts particles
//! of a block that do the same beside one another; lanes pull all of them, take difference moves and mutations one by one, and
//! crossings a few at a time.
//!
//! Positions and velocities are single precision: a coordinate in the unit cube is known to 6e-8 of its range.
//! Every loop over the lanes of a block is plain arithmetic without branches, which the compiler turns into vector
//! instructions. Results depend neither on the instruction set nor on how blocks are spread over threads.

use super::earnings::{Earnings, Move};
use super::relaxation::is_pushed;
use crate::evaluate::resident::BLOCK;
use crate::random::{Random, below_u32, unit_f32};
use crate::scalar::elementary::power;
use crate::swarm::motion::Purpose;
use crate::swarm::settings::{
    BoundHandling, Constriction, DRAWN_PULLS, Leaders, MopsoSettings, Mutation, Randomness,
};
use bytemuck::{Pod, Zeroable};

/// The objectives of a personal best that is not known yet, and of a particle that failed. Those of others lie within it.
pub const UNKNOWN: f32 = f32::MAX;
/// Share of the difference that a difference move takes, and of the coordinates that it changes, as for small swarms.
const SCALE: f32 = 0.5;
const CROSSOVER: f32 = 0.3;
/// Share of the difference moves that change all coordinates.
const ALL_COORDINATES: f32 = 0.3;
/// One more than the distribution indices of the crossover and the mutation of a crossing.
const CROSSING_POWER: f32 = 21.0;
const MUTATION_POWER: f32 = 9.0;
/// Share of the mutations of a crossing that put a coordinate anywhere, as for small swarms.
const ANYWHERE: f32 = 0.15;
/// Particles whose crossings are reckoned together.
const SIDE_BY_SIDE: usize = 16;

/// What is the same for all particles of a generation. Twin of `Generation` in `shaders/swarm.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Generation {
    /// The seed.
    pub key: [u32; 2],
    /// The iteration.
    pub when: u32,
    /// Particles.
    pub particles: u32,
    /// Dimensions of the cube.
    pub dimensions: u32,
    /// Objectives.
    pub objectives: u32,
    /// Members of the archive.
    pub members: u32,
    /// Members that pushed particles follow, behind the others; none where they follow the same.
    pub pushed_members: u32,
    /// Whether pulls are constricted by a coefficient that is drawn with them.
    pub signed: u32,
    /// Whether each dimension has random numbers of its own.
    pub per_dimension: u32,
    /// Whether leaders are the better of two.
    pub tournament: u32,
    /// Whether particles on a device have a row for what they violate constraints by.
    pub constrained: u32,
    /// By how much the members of the archive do.
    pub violation: f32,
    /// The violation that counts as none for pushed particles, and for an archive that they follow.
    pub allowance: f32,
    /// Inertia.
    pub inertia: f32,
    /// Pull to the own best.
    pub cognitive: f32,
    /// Pull to the leader.
    pub social: f32,
    /// Greatest speed.
    pub speed_limit: f32,
    /// What a velocity is multiplied by at a bound.
    pub rebound: f32,
    /// Share of crossings.
    pub crossings: f32,
    /// Share of crossings and difference moves together.
    pub no_pulls: f32,
    /// Share of the particles that polynomial mutation disturbs.
    pub mutation_share: f32,
    /// One more than the distribution index of polynomial mutation.
    pub mutation_power: f32,
    /// One over it.
    pub mutation_root: f32,
    /// Least drawn pull and the range of drawn pulls.
    pub pulls: [f32; 2],
}

impl Generation {
    /// For the moves of iteration `when`, with `members` in the archive.
    pub(in crate::swarm) fn new(
        settings: &MopsoSettings,
        earnings: &Earnings,
        (dimensions, objectives, members): (usize, usize, usize),
        when: usize,
    ) -> Self {
        let motion = &settings.motion;
        let share = when as f64 / (motion.iterations.max(2) - 1) as f64;
        let [inertia, cognitive, social] =
            [motion.inertia, motion.cognitive, motion.social].map(|s| s.at(share));
        let (inertia, cognitive, social) = match motion.constriction {
            Constriction::None | Constriction::Signed => (inertia, cognitive, social),
            Constriction::Clerc => {
                let chi = crate::swarm::motion::constriction(cognitive + social).abs();
                (chi, chi * cognitive, chi * social)
            }
        };
        let [crossings, no_pulls] = earnings.shares(motion.difference_share);
        // A swarm in single precision has no trials: `LargeSwarm::new` refuses them.
        let (mutation_share, index) = match motion.mutation {
            Mutation::Polynomial { share, index } => (share, index),
            Mutation::None | Mutation::Fixed(_) | Mutation::Random => (0.0, 0.0),
        };
        Self {
            key: Random::new(motion.seed).key(),
            when: when as u32,
            particles: motion.population as u32,
            dimensions: dimensions as u32,
            objectives: objectives as u32,
            members: members as u32,
            pushed_members: 0,
            signed: u32::from(motion.constriction == Constriction::Signed),
            per_dimension: u32::from(motion.randomness == Randomness::PerDimension),
            tournament: u32::from(settings.leaders == Leaders::Tournament),
            constrained: 0,
            violation: 0.0,
            allowance: 0.0,
            inertia: inertia as f32,
            cognitive: cognitive as f32,
            social: social as f32,
            speed_limit: motion.speed_limit as f32,
            rebound: match motion.bounds {
                BoundHandling::Absorb => 0.0,
                BoundHandling::Bounce => -0.5,
                BoundHandling::Reverse => -1.0,
            },
            crossings: crossings as f32,
            no_pulls: no_pulls as f32,
            mutation_share: mutation_share as f32,
            mutation_power: (index + 1.0) as f32,
            mutation_root: (1.0 / (index + 1.0)) as f32,
            pulls: [DRAWN_PULLS[0] as f32, (DRAWN_PULLS[1] - DRAWN_PULLS[0]) as f32],
        }
    }

    /// Where the leaders of a particle begin, and how many there are.
    #[inline(always)]
    fn led_by(&self, who: u32) -> (u32, u32) {
        if is_pushed(who as usize) && self.pushed_members > 0 {
            (self.members, self.pushed_members)
        } else {
            (0, self.members)
        }
    }

    /// The move that falls to a word at random.
    #[inline(always)]
    pub(in crate::swarm) fn choice(&self, word: u32) -> Move {
        let uniform = unit_f32(word);
        if uniform < self.crossings {
            Move::Crossing
        } else if uniform < self.no_pulls {
            Move::Difference
        } else {
            Move::Pull
        }
    }

    /// The move that a particle has made.
    pub(in crate::swarm) fn made_by(&self, who: u32) -> Move {
        self.choice(self.words(Purpose::Recombine, who, 0)[0])
    }

    #[inline(always)]
    fn words(&self, purpose: Purpose, who: u32, index: u32) -> [u32; 4] {
        crate::random::philox([index, who, self.when, purpose as u32], self.key)
    }

    #[inline(always)]
    fn words_of(&self, random: Random, purpose: Purpose, first: u32, index: u32) -> [[u32; BLOCK]; 4] {
        random.words_of::<BLOCK>(purpose as u32, self.when, first, index)
    }
}

/// A block's rows, one per coordinate or objective.
type Rows<'a> = &'a [f32];

/// Puts the particles of the block from `first` on anywhere in the cube.
#[inline(always)]
pub fn scatter(generation: &Generation, random: Random, first: u32, position: &mut [f32]) {
    for (four, rows) in position.chunks_mut(4 * BLOCK).enumerate() {
        let words = generation.words_of(random, Purpose::Start, first, four as u32);
        for (row, words) in rows.chunks_exact_mut(BLOCK).zip(&words) {
            for (x, word) in row.iter_mut().zip(words) {
                *x = unit_f32(*word);
            }
        }
    }
}

/// Takes positions for personal bests where their objectives are better; where neither is, by a coin. Returns which it has taken.
#[inline(always)]
pub fn judge(
    generation: &Generation,
    random: Random,
    first: u32,
    (position, objectives): (Rows<'_>, Rows<'_>),
    (best_position, best_objectives): (&mut [f32], &mut [f32]),
) -> [bool; BLOCK] {
    let coins = generation.words_of(random, Purpose::Coin, first, 0);
    let mut no_worse = [true; BLOCK];
    let mut no_better = [true; BLOCK];
    let mut sound = [true; BLOCK];
    for (row, best) in objectives
        .chunks_exact(BLOCK)
        .zip(best_objectives.chunks_exact(BLOCK))
    {
        for lane in 0..BLOCK {
            no_worse[lane] &= row[lane] <= best[lane];
            no_better[lane] &= best[lane] <= row[lane];
            sound[lane] &= row[lane].abs() < UNKNOWN;
        }
    }
    let mut taken = [false; BLOCK];
    for lane in 0..BLOCK {
        // Equal ones are neither better: the coin decides.
        let heads = coins[0][lane] < 1 << 31;
        let better = no_worse[lane] & !no_better[lane];
        let open = no_worse[lane] == no_better[lane];
        taken[lane] = sound[lane] & (better | (open & heads));
    }
    let take = |best: &mut [f32], rows: &[f32]| {
        for (best, row) in best.chunks_exact_mut(BLOCK).zip(rows.chunks_exact(BLOCK)) {
            for lane in 0..BLOCK {
                best[lane] = if taken[lane] { row[lane] } else { best[lane] };
            }
        }
    };
    take(best_position, position);
    take(best_objectives, objectives);
    taken
}

/// Moves the particles of a block. `leaders` are the archive's positions, a row each, the greatest contribution first; then those that
/// pushed particles follow.
#[inline(always)]
pub fn advance(
    generation: &Generation,
    random: Random,
    first: u32,
    best_position: Rows<'_>,
    leaders: &[f32],
    (position, velocity): (&mut [f32], &mut [f32]),
) {
    let g = generation;
    if g.members == 0 {
        // Nobody knows anything yet.
        scatter(g, random, first, position);
        velocity.fill(0.0);
        return;
    }
    let d = g.dimensions as usize;
    let choice = g.words_of(random, Purpose::Recombine, first, 0);
    let mut leader = [0u32; BLOCK];
    for lane in 0..BLOCK {
        let (begin, count) = g.led_by(first + lane as u32);
        let one = below_u32(choice[1][lane], count);
        let two = below_u32(choice[2][lane], count);
        leader[lane] = begin + if g.tournament == 1 { one.min(two) } else { one };
    }
    let draws = g.words_of(random, Purpose::Pulls, first, 0);
    let (mut inertia, mut own, mut social) = ([0.0f32; BLOCK], [0.0f32; BLOCK], [0.0f32; BLOCK]);
    for lane in 0..BLOCK {
        let c1 = g.pulls[0] + g.pulls[1] * unit_f32(draws[0][lane]);
        let c2 = g.pulls[0] + g.pulls[1] * unit_f32(draws[1][lane]);
        let sum = c1 + c2;
        let beyond = sum - 4.0;
        let root = (sum * (if beyond > 0.0 { beyond } else { 0.0 })).sqrt();
        let chi = if beyond > 0.0 {
            2.0 / (-2.0 - beyond - root)
        } else {
            1.0
        };
        let signed = g.signed == 1;
        inertia[lane] = if signed { chi * g.inertia } else { g.inertia };
        own[lane] = if signed { chi * c1 } else { g.cognitive };
        social[lane] = if signed { chi * c2 } else { g.social };
    }
    let mut shares = [[0.0f32; BLOCK]; 2];
    for lane in 0..BLOCK {
        shares[0][lane] = own[lane] * unit_f32(draws[2][lane]);
        shares[1][lane] = social[lane] * unit_f32(draws[3][lane]);
    }
    let mut each = [[[0u32; BLOCK]; 4]; 2];
    for k in 0..d {
        if g.per_dimension == 1 {
            if k % 4 == 0 {
                each[0] = g.words_of(random, Purpose::Cognitive, first, k as u32 / 4);
                each[1] = g.words_of(random, Purpose::Social, first, k as u32 / 4);
            }
            for lane in 0..BLOCK {
                shares[0][lane] = own[lane] * unit_f32(each[0][k % 4][lane]);
                shares[1][lane] = social[lane] * unit_f32(each[1][k % 4][lane]);
            }
        }
        let row = k * BLOCK..(k + 1) * BLOCK;
        let (x, v) = (&mut position[row.clone()], &mut velocity[row.clone()]);
        let best = &best_position[row];
        let mut towards = [0.0f32; BLOCK];
        for lane in 0..BLOCK {
            towards[lane] = leaders[leader[lane] as usize * d + k];
        }
        for lane in 0..BLOCK {
            let speed = inertia[lane] * v[lane]
                + shares[0][lane] * (best[lane] - x[lane])
                + shares[1][lane] * (towards[lane] - x[lane]);
            let speed = speed.max(-g.speed_limit).min(g.speed_limit);
            let moved = x[lane] + speed;
            let inside = moved.clamp(0.0, 1.0);
            v[lane] = if moved == inside { speed } else { speed * g.rebound };
            x[lane] = inside;
        }
    }
    let (mut crossed, mut children) = ([0; BLOCK], 0);
    for lane in 0..BLOCK {
        let who = first + lane as u32;
        match g.choice(choice[0][lane]) {
            Move::Crossing => {
                crossed[children] = lane;
                children += 1;
                continue;
            }
            Move::Difference => {
                let from = leader[lane] as usize;
                difference(g, who, lane, (leaders, from), (position, velocity));
            }
            Move::Pull => (),
        }
        if unit_f32(choice[3][lane]) < g.mutation_share {
            disturb(g, who, lane, position);
        }
    }
    for few in crossed[..children].chunks(SIDE_BY_SIDE) {
        cross_few(g, first, few, (leaders, &leader), (position, velocity));
    }
}

/// From an archive member along the difference of two others, in some of the coordinates or in all.
#[inline(always)]
fn difference(
    g: &Generation,
    who: u32,
    lane: usize,
    (leaders, from): (&[f32], usize),
    (position, velocity): (&mut [f32], &mut [f32]),
) {
    let d = g.dimensions as usize;
    let picks = g.words(Purpose::Difference, who, 0);
    let (begin, count) = g.led_by(who);
    let [one, two] = [0, 1].map(|i| (begin + below_u32(picks[i], count)) as usize);
    let always = below_u32(picks[2], g.dimensions) as usize;
    let whole = unit_f32(picks[3]) < ALL_COORDINATES;
    let mut words = [0; 4];
    for k in 0..d {
        if k % 4 == 0 {
            words = g.words(Purpose::Difference, who, 1 + k as u32 / 4);
        }
        let chosen = whole || k == always || unit_f32(words[k % 4]) < CROSSOVER;
        let step = SCALE * (leaders[one * d + k] - leaders[two * d + k]);
        let moved = leaders[from * d + k] + if chosen { step } else { 0.0 };
        position[k * BLOCK + lane] = moved.clamp(0.0, 1.0);
        velocity[k * BLOCK + lane] = 0.0;
    }
}

/// To places between or about two archive members, each coordinate by itself, disturbed by mutation; the particles of a few lanes
/// side by side.
#[inline(always)]
fn cross_few(
    g: &Generation,
    first: u32,
    lanes: &[usize],
    (leaders, leader): (&[f32], &[u32; BLOCK]),
    (position, velocity): (&mut [f32], &mut [f32]),
) {
    let d = g.dimensions as usize;
    let (mut who, mut ones, mut others) = ([first; SIDE_BY_SIDE], [0; SIDE_BY_SIDE], [0; SIDE_BY_SIDE]);
    for (i, lane) in lanes.iter().enumerate() {
        who[i] = first + *lane as u32;
        ones[i] = leader[*lane] as usize * d;
        let (begin, count) = g.led_by(who[i]);
        others[i] = (begin + below_u32(g.words(Purpose::Recombine, who[i], 1)[0], count)) as usize * d;
    }
    for k in 0..d {
        let mut words = [[0; SIDE_BY_SIDE]; 4];
        for i in 0..SIDE_BY_SIDE {
            let four = g.words(Purpose::Recombine, who[i], 2 + k as u32);
            for (plane, word) in words.iter_mut().zip(four) {
                plane[i] = word;
            }
        }
        let (mut one, mut other) = ([0.0; SIDE_BY_SIDE], [0.0; SIDE_BY_SIDE]);
        for i in 0..lanes.len() {
            (one[i], other[i]) = (leaders[ones[i] + k], leaders[others[i] + k]);
        }
        let mut child = [0.0; SIDE_BY_SIDE];
        for i in 0..SIDE_BY_SIDE {
            child[i] = cross(one[i], other[i], words[0][i], unit_f32(words[1][i]));
        }
        for (i, lane) in lanes.iter().enumerate() {
            let mut x = child[i];
            let mutates = unit_f32(words[2][i]) * (d as f32);
            if mutates < ANYWHERE {
                x = unit_f32(words[3][i]);
            } else if mutates < 1.0 {
                x = polynomial(x, unit_f32(words[3][i]), (MUTATION_POWER, 1.0 / MUTATION_POWER));
            }
            position[k * BLOCK + lane] = x;
            velocity[k * BLOCK + lane] = 0.0;
        }
    }
}

/// The coordinate of `one` by half of the words at random, each of the two children of both by a quarter.
#[inline(always)]
fn cross(one: f32, other: f32, word: u32, uniform: f32) -> f32 {
    let below = word < 1 << 30;
    let low = if one < other { one } else { other };
    let high = if one < other { other } else { one };
    let gap = high - low;
    let room = if below { low } else { 1.0 - high };
    let share = uniform * (2.0 - power(gap / (gap + (room + room)), CROSSING_POWER));
    let near = share <= 1.0;
    let root = power(if near { share } else { 2.0 - share }, 1.0 / CROSSING_POWER);
    let half = 0.5 * (gap * if near { root } else { 1.0 / root });
    let middle = 0.5 * (low + high);
    let moved = if below { middle - half } else { middle + half };
    let child = moved.clamp(0.0, 1.0);
    // Of two that are the same there is no other.
    if word < 1 << 31 && gap > 0.0 { child } else { one }
}

/// Polynomial mutation of each coordinate with probability one over their number.
#[inline(always)]
fn disturb(g: &Generation, who: u32, lane: usize, position: &mut [f32]) {
    let mut words = [0; 4];
    for k in 0..g.dimensions as usize {
        if k % 2 == 0 {
            words = g.words(Purpose::Mutation, who, k as u32 / 2);
        }
        let pair = 2 * (k % 2);
        if unit_f32(words[pair]) * (g.dimensions as f32) < 1.0 {
            let x = &mut position[k * BLOCK + lane];
            *x = polynomial(*x, unit_f32(words[pair + 1]), (g.mutation_power, g.mutation_root));
        }
    }
}

/// As for small swarms, in single precision.
#[inline(always)]
fn polynomial(x: f32, uniform: f32, (exponent, root): (f32, f32)) -> f32 {
    let low = uniform < 0.5;
    let part = if low {
        uniform + uniform
    } else {
        2.0 - (uniform + uniform)
    };
    let room = if low { 1.0 - x } else { x };
    let base = part + (1.0 - part) * power(room, exponent);
    let step = power(base, root) - 1.0;
    let moved = if low { x + step } else { x - step };
    moved.clamp(0.0, 1.0)
}
