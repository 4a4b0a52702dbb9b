//! The kernels and buffers of a swarm on its device.

use super::{AT_ONCE, BLOCK, HEADER, most_particles};
use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::{swarm, swarm_gather};
use crate::evaluate::gpu::{Binding, GpuContext, Kernel};
use crate::swarm::mopso::blocks::Generation;
use crate::swarm::mopso::thinning::PER_PLACE;
use crate::swarm::settings::MopsoSettings;
use crate::swarm::space::Space;
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// The kernels that a swarm needs after its particles are scattered.
pub(super) struct Kernels {
    pub learn: Arc<Kernel>,
    pub note: Arc<Kernel>,
    pub advance: Arc<Kernel>,
    pub gather: Arc<Kernel>,
}

/// What a swarm has on its device.
pub(super) struct Buffers {
    pub generation: wgpu::Buffer,
    pub archive: wgpu::Buffer,
    pub position: wgpu::Buffer,
    pub velocity: wgpu::Buffer,
    pub best_position: wgpu::Buffer,
    pub best_objectives: wgpu::Buffer,
    pub objectives: wgpu::Buffer,
    pub found: wgpu::Buffer,
    /// As large as the largest of what is read back.
    pub readback: wgpu::Buffer,
    pub gathering: wgpu::Buffer,
    pub rows: wgpu::Buffer,
    pub swarm: wgpu::BindGroup,
    /// Gathers positions, own bests and objectives.
    pub gather: wgpu::BindGroup,
    pub gather_bests: wgpu::BindGroup,
    pub gather_objectives: wgpu::BindGroup,
}

/// Kernels and buffers for so many objectives, and a row more if there are constraints; and the kernel that scatters the particles.
///
/// # Errors
/// [`Error::Input`] where the device has no room for so many particles, [`Error::Device`] if it fails.
pub(super) fn on_device(
    settings: &MopsoSettings,
    space: &Space,
    (objectives, constrained): (usize, bool),
    context: &GpuContext,
) -> Result<(Kernels, Buffers, Arc<Kernel>)> {
    use Binding::{Read, Uniform, Write};
    let d = space.dimensions();
    let bindings = [Uniform, Read, Write, Write, Write, Write, Write, Write];
    let source = swarm();
    let kernel = |entry: &str| context.kernel(&source, entry, &bindings);
    let scatter = kernel("scatter")?;
    let kernels = Kernels {
        learn: kernel("learn")?,
        note: kernel("note")?,
        advance: kernel("advance")?,
        gather: context.kernel(&swarm_gather(), "gather", &[Uniform, Read, Read, Write])?,
    };
    let n = settings.motion.population;
    let lanes = n.next_multiple_of(BLOCK) as u64;
    let width = objectives + usize::from(constrained);
    let (state, worth) = (lanes * d as u64 * 4, lanes * width as u64 * 4);
    // Pushed particles may follow an archive of their own.
    let members = (2 * settings.archive + AT_ONCE) as u64;
    let most = PER_PLACE * settings.archive;
    // An own best may stand in for more than one member.
    let listed = HEADER + lanes.max(settings.archive as u64) * 16;
    let gathered = (most.max(AT_ONCE) * d.max(width)) as u64 * 4;
    let largest = state.max(worth).max(listed + gathered);
    let room = most_particles(context, d);
    if n > room {
        let found = n.to_string();
        let expected = format!(
            "at most {room} particles of {d} variables on {}",
            context.summary()
        );
        return Err(Error::input(
            "the swarm's settings",
            "population",
            found,
            expected,
        ));
    }
    let on = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
    let size = size_of::<Generation>() as u64;
    let generation = context.buffer("generation", size, Usage::UNIFORM | Usage::COPY_DST)?;
    let leaders = context.buffer("archive", members * d.max(3) as u64 * 4, on)?;
    let position = context.buffer("positions", state, on)?;
    let velocity = context.buffer("velocities", state, on)?;
    let best_position = context.buffer("best positions", state, on)?;
    let best_objectives = context.buffer("best objectives", worth, on)?;
    let worths = context.buffer("objectives", worth, on)?;
    let found = context.buffer("candidates", listed, on)?;
    let readback = context.buffer("readback", largest, Usage::MAP_READ | Usage::COPY_DST)?;
    let gathering = context.buffer("gathering", 16, Usage::UNIFORM | Usage::COPY_DST)?;
    let rows = context.buffer("chosen positions", gathered, on)?;
    let state = [
        &generation,
        &leaders,
        &position,
        &velocity,
        &best_position,
        &best_objectives,
        &worths,
        &found,
    ];
    let swarm = context.bind(&scatter, &state)?;
    let gather = context.bind(&kernels.gather, &[&gathering, &found, &position, &rows])?;
    let gather_bests = context.bind(&kernels.gather, &[&gathering, &found, &best_position, &rows])?;
    let gather_objectives = context.bind(&kernels.gather, &[&gathering, &found, &worths, &rows])?;
    let buffers = Buffers {
        generation,
        archive: leaders,
        position,
        velocity,
        best_position,
        best_objectives,
        objectives: worths,
        found,
        readback,
        gathering,
        rows,
        swarm,
        gather,
        gather_bests,
        gather_objectives,
    };
    Ok((kernels, buffers, scatter))
}
