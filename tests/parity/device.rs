//! The device that tests run on, if there is one, and small kernels around single shader functions.

use lapswarm::evaluate::gpu::shader::{ELEMENTARY, car_fragments, loaders};
use lapswarm::evaluate::gpu::{DeviceKind, GpuContext};
use lapswarm::vehicle::TyreModel;
use std::sync::Arc;

/// The device; `None` with a word on standard error if there is none and none is required.
pub fn device() -> Option<Arc<GpuContext>> {
    match GpuContext::shared(None) {
        Ok(context) => Some(context),
        Err(error) => {
            let required = std::env::var("LAPSWARM_REQUIRE_GPU").is_ok_and(|x| x == "1");
            assert!(!required, "LAPSWARM_REQUIRE_GPU=1, but {error}");
            eprintln!("IGNORED: no GPU adapter ({error})");
            None
        }
    }
}

/// Whether the device is known to round every operation as the processor does. Others may contract a product and
/// a sum, or divide to 2.5 ULP, as WGSL lets them.
pub fn rounds_like_the_processor(context: &GpuContext) -> bool {
    let summary = context.summary();
    summary.kind == DeviceKind::Software && summary.driver == "llvmpipe"
}

/// `function` (of four figures at once) over `inputs`, whose count is a multiple of four.
pub fn map(context: &GpuContext, function: &str, inputs: &[f32]) -> Vec<f32> {
    let source = format!(
        "{ELEMENTARY}
        @group(0) @binding(0) var<storage, read> from_host: array<vec4<f32>>;
        @group(0) @binding(1) var<storage, read_write> to_host: array<vec4<f32>>;
        @compute @workgroup_size(64) fn apply(@builtin(global_invocation_id) id: vec3<u32>) {{
            if id.x < arrayLength(&from_host) {{ to_host[id.x] = {function}(from_host[id.x]); }}
        }}"
    );
    context
        .run_array(&source, "apply", inputs, inputs.len(), inputs.len() / 4)
        .expect("the kernel runs")
}

/// The car's fragments with loaders that take every figure from rows of `lanes` floats at the front of the input,
/// which is bound as `figures`; `to_host` is the output.
pub fn car_source(model: TyreModel, figures: usize, lanes: usize, entry: &str) -> String {
    let sources: Vec<_> = (0..figures).map(Some).collect();
    format!(
        "{}
        struct Rows {{ stride: u32 }}
        const stretch = Rows({lanes}u);
        const AFTER_FIGURES = {}u;
        @group(0) @binding(0) var<storage, read> figures: array<f32>;
        @group(0) @binding(1) var<storage, read_write> to_host: array<f32>;
        {}
        {entry}",
        car_fragments(model).concat(),
        figures * lanes,
        loaders(model, &sources),
    )
}
