//! The tables of a line's sections and of a car's envelope on a device, and what a line kernel is specialised to by them.

use crate::error::{Error, Result};
use crate::evaluate::gpu::shader::LineShape;
use crate::evaluate::gpu::{Binding, DeviceKind, GpuContext, LOOP_ROUNDS, workgroup};
use crate::line::kernel::Wanted;
use crate::line::{EnvelopeTable, LinePlan, SectionRow, TERMS};
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages as Usage;

/// Lanes that a software driver works on at once: their figures fill one line of the processor's cache.
const SOFTWARE_TILE: u32 = 8;

/// Rounds of all loops of a kernel for each section, at the most: three of the shape's, two laps of either pass and one of the
/// times; with energy, the run-in and its two laps besides.
const ROUNDS_PER_SECTION: usize = 10;
/// The same of a road in three dimensions: one more of the shape, and those of the corner speed.
const RELIEF_ROUNDS: usize = 14;

/// One section on the device. Twin of `Section` in `shaders/line.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct DeviceSection {
    /// Which variables `alpha` is the sum of.
    pub sources: [u32; TERMS],
    /// Their weights.
    pub weights: [f32; TERMS],
    /// From the right end of this cross-section to that of the next, m.
    pub step: [f32; 2],
    /// From the right end of the cross-section to the left end, m.
    pub across: [f32; 2],
    /// The part of `alpha` that no variable moves.
    pub constant: f32,
    /// One over the spacing of second differences, 1/m.
    pub inverse_spacing: f32,
    /// The next section whose `alpha` is the sum of other variables, or one past the last.
    pub until: u32,
    /// 1 where the DRS may be open from here to the next section, else 0.
    pub drs: u32,
}

impl DeviceSection {
    /// The sections of a plan.
    fn all_of(plan: &LinePlan<f32>) -> Vec<Self> {
        let rows: &[SectionRow<f32>] = &plan.rows;
        let mut sections: Vec<Self> = rows
            .iter()
            .map(|row| Self {
                sources: row.sources,
                weights: row.weights,
                step: row.step,
                across: row.across,
                constant: row.constant,
                inverse_spacing: row.inverse_spacing,
                until: rows.len() as u32,
                drs: u32::from(row.drs),
            })
            .collect();
        for i in (1..sections.len()).rev() {
            sections[i - 1].until = if sections[i - 1].sources == sections[i].sources {
                sections[i].until
            } else {
                i as u32
            };
        }
        // Height, banking and friction stand behind all of them.
        let relief = plan.relief.iter().map(|row| Self {
            weights: [row.step_rise, row.across_rise, row.sin, row.cos],
            sources: row.friction_rises.map(f32::to_bits),
            step: [row.friction_from, row.friction_across],
            constant: row.friction,
            ..Self::zeroed()
        });
        sections.extend(relief);
        sections
    }
}

/// The tables of the kernel's bindings 1 to 4.
pub(in crate::evaluate) struct LineTables {
    pub(in crate::evaluate) shape: LineShape,
    pub(in crate::evaluate) bindings: [Binding; 4],
    pub(in crate::evaluate) buffers: [wgpu::Buffer; 4],
}

impl LineTables {
    /// The tables of `plan` and `envelope` on `context`'s device.
    ///
    /// # Errors
    /// [`Error::Device`] if the sections do not fit the device.
    pub(in crate::evaluate) fn new(
        context: &GpuContext,
        plan: &LinePlan<f32>,
        envelope: &EnvelopeTable<f32>,
        wanted: Wanted,
    ) -> Result<Self> {
        let device = context.limits();
        let software = context.summary().kind == DeviceKind::Software;
        let workgroup = workgroup(context);
        let sections = DeviceSection::all_of(plan);
        // Two figures to a row; uniform rows are of four.
        let rows_of_four = |table: &[f32]| -> Vec<f32> {
            table
                .chunks_exact(2)
                .flat_map(|row| [row[0], row[1], 0.0, 0.0])
                .collect()
        };
        let (corners, mut ellipse) = (rows_of_four(&envelope.corners), rows_of_four(&envelope.ellipse));
        let ellipse_rows = ellipse.len() / 4;
        if ellipse.is_empty() {
            // A binding holds at least what its type takes.
            ellipse = vec![0.0; 4];
        }
        let open = envelope
            .open
            .as_deref()
            .filter(|_| plan.rows.iter().any(|row| row.drs));
        let states = [Some(envelope), open].into_iter().flatten();
        let mut limits = Vec::new();
        for state in states {
            limits.extend([state.rows.as_slice(), &state.traction].concat());
            // Under each load the rows, then the cells.
            let loads = &state.loads;
            if plan.relief.is_empty() || loads.tables == 0 {
                continue;
            }
            let (rows, cells) = (
                loads.rows.len() / loads.tables,
                loads.traction.len() / loads.tables,
            );
            for table in 0..loads.tables {
                limits.extend_from_slice(&loads.rows[table * rows..(table + 1) * rows]);
                limits.extend_from_slice(&loads.traction[table * cells..(table + 1) * cells]);
            }
        }
        let relief = (!plan.relief.is_empty() && wanted.lap).then_some(envelope.loads.tables);
        let device_sections = sections.len();
        let sections: &[u8] = bytemuck::cast_slice(&sections);
        let more = if relief.is_some() { RELIEF_ROUNDS } else { 0 };
        let most = LOOP_ROUNDS / (ROUNDS_PER_SECTION + more);
        if software && plan.rows.len() > most {
            return Err(Error::Device(format!(
                "{} limits the length of loops: it can evaluate at most {most} cross-sections, {} are needed",
                context.summary(),
                plan.rows.len()
            )));
        }
        let fits = |bytes: usize| bytes as u64 <= device.max_uniform_buffer_binding_size;
        let uniform_sections = fits(sections.len());
        // A card reads a uniform table row after row where lanes part; a software driver is faster with it.
        let uniform_envelope = software
            && [&limits, &corners, &ellipse]
                .iter()
                .all(|table| fits(size_of_val(table.as_slice())));
        let shape = LineShape {
            closed: plan.closed,
            terms: plan.terms,
            wanted,
            envelope_rows: envelope.rows.len() / 8,
            corner_rows: corners.len() / 4,
            ellipse_rows,
            steering_rate: envelope.curvature_rate_squared.is_some(),
            traction: !envelope.traction.is_empty(),
            drs: open.is_some(),
            relief,
            uniform_sections: uniform_sections.then_some(device_sections),
            uniform_envelope,
            workgroup,
            // A card's neighbouring lanes, however many, read together.
            tile: if software && workgroup.is_multiple_of(SOFTWARE_TILE) {
                SOFTWARE_TILE
            } else {
                workgroup
            },
        };
        let table_binding = |uniform: bool| if uniform { Binding::Uniform } else { Binding::Read };
        let envelope_binding = table_binding(uniform_envelope);
        let both = Usage::STORAGE | Usage::UNIFORM;
        let table = |label: &str, data: &[f32]| context.buffer_of(label, bytemuck::cast_slice(data), both);
        Ok(Self {
            shape,
            bindings: [
                table_binding(uniform_sections),
                envelope_binding,
                envelope_binding,
                envelope_binding,
            ],
            buffers: [
                context.table("sections", sections, Usage::UNIFORM)?,
                table("envelope", &limits)?,
                table("corners", &corners)?,
                table("ellipse", &ellipse)?,
            ],
        })
    }
}
