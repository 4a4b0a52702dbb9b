//! Particles in blocks of lanes, and how they move. Twin of `shaders/swarm.wgsl`, with the same operations. The kernel moves a
//! particle in one pass over its coordinates, for memory's sake; lanes take the few difference moves and mutations one by one.
//!
//! Positions and velocities are single precision: a coordinate in the unit cube is known to 6e-8 of its range.
//! Every loop over the lanes of a block is plain arithmetic without branches, which the compiler turns into vector
//! instructions. Results depend neither on the instruction set nor on how blocks are spread over threads.

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
    /// Whether pulls are constricted by a coefficient that is drawn with them.
    pub signed: u32,
    /// Whether each dimension has random numbers of its own.
    pub per_dimension: u32,
    /// Whether leaders are the better of two.
    pub tournament: u32,
    /// Whether there is mutation.
    pub mutation: u32,
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
    /// Share of difference moves.
    pub difference_share: f32,
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
    pub fn new(
        settings: &MopsoSettings,
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
            signed: u32::from(motion.constriction == Constriction::Signed),
            per_dimension: u32::from(motion.randomness == Randomness::PerDimension),
            tournament: u32::from(settings.leaders == Leaders::Tournament),
            mutation: u32::from(mutation_share > 0.0),
            inertia: inertia as f32,
            cognitive: cognitive as f32,
            social: social as f32,
            speed_limit: motion.speed_limit as f32,
            rebound: match motion.bounds {
                BoundHandling::Absorb => 0.0,
                BoundHandling::Bounce => -0.5,
                BoundHandling::Reverse => -1.0,
            },
            difference_share: motion.difference_share as f32,
            mutation_share: mutation_share as f32,
            mutation_power: (index + 1.0) as f32,
            mutation_root: (1.0 / (index + 1.0)) as f32,
            pulls: [DRAWN_PULLS[0] as f32, (DRAWN_PULLS[1] - DRAWN_PULLS[0]) as f32],
        }
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

/// Takes positions for personal bests where their objectives are better; where neither is, by a coin.
#[inline(always)]
pub fn judge(
    generation: &Generation,
    random: Random,
    first: u32,
    (position, objectives): (Rows<'_>, Rows<'_>),
    (best_position, best_objectives): (&mut [f32], &mut [f32]),
) {
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
}

/// Moves the particles of a block. `leaders` are the archive's positions, a row each, the greatest contribution first.
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
        let one = below_u32(choice[1][lane], g.members);
        let two = below_u32(choice[2][lane], g.members);
        leader[lane] = if g.tournament == 1 { one.min(two) } else { one };
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
    for lane in 0..BLOCK {
        let who = first + lane as u32;
        if unit_f32(choice[0][lane]) < g.difference_share {
            let from = leader[lane] as usize;
            difference(g, who, lane, (leaders, from), (position, velocity));
        }
        if g.mutation == 1 && unit_f32(choice[3][lane]) < g.mutation_share {
            disturb(g, who, lane, position);
        }
    }
}

/// From an archive member along the difference of two others, in some of the coordinates.
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
    let [one, two] = [0, 1].map(|i| below_u32(picks[i], g.members) as usize);
    let always = below_u32(picks[2], g.dimensions) as usize;
    let mut words = [0; 4];
    for k in 0..d {
        if k % 4 == 0 {
            words = g.words(Purpose::Difference, who, 1 + k as u32 / 4);
        }
        let chosen = k == always || unit_f32(words[k % 4]) < CROSSOVER;
        let step = SCALE * (leaders[one * d + k] - leaders[two * d + k]);
        let moved = leaders[from * d + k] + if chosen { step } else { 0.0 };
        position[k * BLOCK + lane] = moved.clamp(0.0, 1.0);
        velocity[k * BLOCK + lane] = 0.0;
    }
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
            *x = polynomial(g, *x, unit_f32(words[pair + 1]));
        }
    }
}

/// As for small swarms, in single precision.
#[inline(always)]
fn polynomial(g: &Generation, x: f32, uniform: f32) -> f32 {
    let low = uniform < 0.5;
    let part = if low {
        uniform + uniform
    } else {
        2.0 - (uniform + uniform)
    };
    let room = if low { 1.0 - x } else { x };
    let base = part + (1.0 - part) * power(room, g.mutation_power);
    let step = power(base, g.mutation_root) - 1.0;
    let moved = if low { x + step } else { x - step };
    moved.clamp(0.0, 1.0)
}
