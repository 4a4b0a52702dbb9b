//! Populations that live on a device, where neither candidates nor objectives cross the bus.

#[cfg(feature = "gpu")]
use super::Failure;

/// Particles of a block: a coordinate of all of them lies in a row, and the coordinates of a block follow one another.
pub const BLOCK: usize = 64;

/// Objectives of a particle whose size is this or more are no costs: the particle has failed. This and the code of a [`Failure`] in
/// the last eight bits say why; any other says that the objective is beyond single precision.
#[cfg(feature = "gpu")]
pub(crate) const FAILED: u32 = 0x7f7f_ff00;

/// What stands in the row of objectives of a particle that failed.
#[cfg(feature = "gpu")]
pub fn failed_objective(failure: Failure) -> f32 {
    f32::from_bits(FAILED | failure.code())
}

/// Objectives of particles whose positions are on a device.
#[cfg(feature = "gpu")]
pub trait DeviceObjectives {
    /// The problem that they are of.
    fn problem(&self) -> &super::Problem;

    /// Whether there are constraints, and a row that says by how much they are violated. Swarms go by Deb's rules then: what violates
    /// less is better, whatever its objectives.
    fn is_constrained(&self) -> bool {
        false
    }

    /// Writes the objectives of `particles` particles. Both buffers are in blocks of [`BLOCK`] particles: a coordinate of
    /// all particles of a block in a row of `f32`, the coordinates of a block one after the other. Positions are
    /// in the unit cube of those variables whose bounds differ; [`super::Variable::at`] says what they stand for. A particle that
    /// failed has [`failed_objective`] for every objective. Where the problem is constrained, a row more follows: by how much each
    /// particle violates its constraints in all, zero for one that keeps them.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    fn evaluate(
        &mut self,
        particles: usize,
        position: &wgpu::Buffer,
        objectives: &wgpu::Buffer,
    ) -> crate::Result<()>;
}

/// Coordinates of a particle that a lane of a card takes: a card is only filled by many lanes, and has those of few particles early.
#[cfg(feature = "gpu")]
const SLICE: usize = 16;

/// Workgroups along two dimensions, for a particle to a lane.
#[cfg(feature = "gpu")]
pub(crate) fn groups(particles: usize) -> (u32, u32) {
    let all = particles.div_ceil(BLOCK);
    let wide = all.clamp(1, 1 << 15);
    (wide as u32, all.div_ceil(wide) as u32)
}

/// Workgroups along three dimensions, for a slice of the `width` coordinates of a particle to a lane. A software driver has no more
/// lanes than processors, and takes all of a particle at once.
#[cfg(feature = "gpu")]
pub(crate) fn sliced_groups(context: &super::gpu::GpuContext, particles: usize, width: usize) -> [u32; 3] {
    let (x, y) = groups(particles);
    let slices = if context.is_shaped_for_a_card() {
        width.div_ceil(SLICE)
    } else {
        1
    };
    [x, y, slices as u32]
}
