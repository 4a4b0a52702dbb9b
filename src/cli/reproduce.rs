//! `lapswarm reproduce`.

use super::check::draw_bundled;
use super::study::{Resume, print_plan, print_results};
use super::sweep::verdict;
use super::{Common, Memory, backend_flag, progress::Bar, stop_flag, stopped, to_json};
use lapswarm::Result;
use lapswarm::config::limit_memory;
use lapswarm::evaluate::BackendChoice;
use lapswarm::files::run_folder;
use lapswarm::study::framework::Plan;
use lapswarm::study::reproduce::{
    EvaluatedOn, REPRODUCE_FILE, ReproduceRequest, ReproduceSettings, begin, reproduce,
};

/// Flags of `reproduce`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm reproduce --quick\n  lapswarm reproduce --chapter 7 --out chapter7\n  lapswarm \
                  reproduce --out thesis\n  lapswarm reproduce --out thesis --resume\n\nEach table has a folder of its own in the \
                  run folder, with the page of its study. Curves of tyres and cars have one, too."
)]
pub struct Arguments {
    /// A chapter, 2 to 7; may be repeated [default: all]
    #[arg(long, value_name = "N")]
    chapter: Vec<u8>,
    /// A subset: fewer settings, fewer seeds
    #[arg(long)]
    quick: bool,
    /// Where candidates are evaluated: auto, cpu, simd or gpu [default: auto]
    #[arg(long, value_name = "BACKEND", value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use, or all for several
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    memory: Memory,
    #[command(flatten)]
    resume: Resume,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let common = &arguments.common;
    limit_memory(arguments.memory.memory_limit_mib);
    let backend = arguments.backend.unwrap_or(BackendChoice::Auto);
    // A device that is not there shows before anything is written.
    backend.would_be(arguments.adapter.as_deref())?;
    let on = EvaluatedOn {
        backend: arguments.backend,
        adapter: arguments.adapter.clone(),
    };
    let settings = ReproduceSettings::new(&arguments.chapter, arguments.quick, on)?;
    if common.dry_run {
        let plan = Plan::of_file("reproduce", &settings.to_toml());
        let plan = settings.plan()?.into_iter().fold(plan, Plan::reads);
        let plan = plan.backend(backend, arguments.adapter.as_deref())?;
        return print_plan(common, &plan.into_folder(common.out.as_deref())?);
    }
    let folder = if arguments.resume.resume {
        run_folder::reopen_by(common.out.as_deref().unwrap_or("".as_ref()), REPRODUCE_FILE)?
    } else {
        let created = run_folder::create("reproduce", common.out.as_deref())?;
        begin(&settings, &created)?;
        created
    };
    let stop = stop_flag();
    let mut bar = Bar::new(common.quiet);
    let reproduced = reproduce(
        &settings,
        &folder,
        ReproduceRequest {
            save_every: arguments.resume.save_every(),
            time_limit: arguments.resume.time_limit(),
            memory_limit_mib: arguments.memory.memory_limit_mib,
            stop: stop.clone(),
            observe: &mut |progress| {
                bar.show(progress);
                stopped(&stop)
            },
            draw: &|drawing, folder| draw_bundled(&drawing.car, drawing.tyres, folder),
        },
    );
    bar.finish();
    let summary = reproduced?;
    print_results(common, &summary.to_text(), Some(&folder), &to_json(&summary)?);
    let tables = summary.tables.into_iter();
    let failed: Vec<String> = tables.flat_map(|table| table.failed_runs).collect();
    verdict(&failed)
}
