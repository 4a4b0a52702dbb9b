//! The subcommands of the studies, made from the registry.

use super::output::{errln, out};
use super::{Common, Memory, print_json_text, progress::Bar, stop_flag, stopped, to_json};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};
use lapswarm::config::settings::{Declared, Flag};
use lapswarm::study::framework::{Answer, Plan, Request};
use lapswarm::study::registry::Registered;
use lapswarm::{Error, Result};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Flags of a run that can be resumed.
#[derive(Args)]
pub struct Resume {
    /// Resume the interrupted run in --out, with its own settings
    #[arg(long, requires = "out", conflicts_with = "dry_run")]
    pub resume: bool,
    /// Time between saves of the run's state, s
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = pause)]
    save_every_s: f64,
    /// Time after which the run ends in order with what it has, s; --resume continues it
    #[arg(long, value_name = "SECONDS", value_parser = pause)]
    time_limit_s: Option<f64>,
}

impl Resume {
    /// Time between saves; the flag's parser has seen to what it can be.
    pub fn save_every(&self) -> Duration {
        Duration::try_from_secs_f64(self.save_every_s).unwrap_or_default()
    }

    /// Time after which the run ends.
    pub fn time_limit(&self) -> Option<Duration> {
        self.time_limit_s
            .and_then(|s| Duration::try_from_secs_f64(s).ok())
    }
}

/// Parses a time in seconds.
pub fn pause(text: &str) -> Result<f64, String> {
    let seconds = text
        .parse()
        .ok()
        .filter(|s| Duration::try_from_secs_f64(*s).is_ok());
    seconds.ok_or_else(|| "expected a time in seconds, 0 or more".to_owned())
}

/// The subcommand of a study.
pub fn command(study: &'static dyn Registered) -> Command {
    let file = Arg::new("study")
        .value_name("STUDY.toml")
        .value_parser(value_parser!(PathBuf))
        .help("A study file; every flag has its twin in it, and wins over it");
    let command = Command::new(study.name()).arg(file);
    let command = Memory::augment_args(Resume::augment_args(Common::augment_args(command)));
    let declared = study.declared().into_iter();
    command
        // After the others' flags, which bring words of their own.
        .about(study.about().trim_end_matches('.'))
        .after_help(study.details())
        .args(declared.filter_map(|d| argument(study, &d)))
}

/// The flag of a setting.
fn argument(study: &'static dyn Registered, declared: &Declared) -> Option<Arg> {
    let long = declared.flag.name()?.replace('_', "-");
    let key = declared.key;
    let arg = Arg::new(key).long(long);
    // As a flag takes it: without the marks of TOML.
    let default = study.default_of(key).unwrap_or_default();
    let default = default.replace(['"', '[', ']'], "").replace(", ", ",");
    let help = if default.is_empty() {
        declared.described()
    } else {
        format!("{} [default: {default}]", declared.described())
    };
    let parser = move |text: &str| study.check_flag(key, text).map(|()| text.to_owned());
    Some(match declared.flag {
        Flag::Switch(_, on) => {
            let sets = format!("{} [sets {} = {on}]", declared.described(), declared.key);
            arg.action(ArgAction::SetTrue).help(sets)
        }
        Flag::List(_) | Flag::Repeated(_) => arg
            .action(ArgAction::Append)
            .value_name(declared.value_name)
            .value_parser(parser)
            .help(help),
        _ => arg
            .value_name(declared.value_name)
            .value_parser(parser)
            .help(help),
    })
}

/// What the flags say, by the keys of the settings.
fn flags(study: &dyn Registered, matches: &ArgMatches) -> Vec<(String, String)> {
    let said = |d: &Declared| -> Option<String> {
        let all = |between: &str| {
            let values: Option<Vec<String>> = matches
                .get_many::<String>(d.key)
                .map(|values| values.cloned().collect());
            values.map(|values| values.join(between))
        };
        match d.flag {
            Flag::Switch(_, on) => matches.get_flag(d.key).then(|| on.to_string()),
            Flag::Value(_) => matches.get_one::<String>(d.key).cloned(),
            Flag::List(_) => all(","),
            Flag::Repeated(_) => all("\n"),
            Flag::None => None,
        }
    };
    let declared = study.declared();
    declared
        .iter()
        .filter_map(|d| Some((d.key.to_owned(), said(d)?)))
        .collect()
}

/// Runs a study and prints what comes of it.
pub fn run(study: &'static dyn Registered, matches: &ArgMatches) -> Result<()> {
    let bad = |e: clap::Error| Error::input("the command line", "flags", e.to_string(), "those of --help");
    let common = Common::from_arg_matches(matches).map_err(bad)?;
    let resume = Resume::from_arg_matches(matches).map_err(bad)?;
    let memory = Memory::from_arg_matches(matches).map_err(bad)?;
    let stop = stop_flag();
    let mut bar = Bar::new(common.quiet);
    let answer = study.run(Request {
        file: matches.get_one::<PathBuf>("study").map(PathBuf::as_path),
        text: None,
        flags: &flags(study, matches),
        out: common.out.as_deref(),
        resume: resume.resume,
        save_every: resume.save_every(),
        time_limit: resume.time_limit(),
        memory_limit_mib: memory.memory_limit_mib,
        dry_run: common.dry_run,
        stop: stop.clone(),
        observe: &mut |progress| {
            bar.show(progress);
            stopped(&stop)
        },
    });
    bar.finish();
    match answer? {
        Answer::Planned(plan) => print_plan(&common, &plan),
        Answer::Finished(finished) => {
            print_results(&common, &finished.text, Some(&finished.folder), &finished.json);
            for warning in &finished.warnings {
                errln!("Warning: {warning}");
            }
            finished.verdict
        }
    }
}

/// Prints a plan, as words or as JSON.
pub fn print_plan(common: &Common, plan: &Plan) -> Result<()> {
    print_results(common, &plan.to_text(), None, &to_json(plan)?);
    Ok(())
}

/// Prints what was found, as words and as JSON.
pub fn print_results(common: &Common, text: &str, folder: Option<&Path>, json: &str) {
    if !common.quiet {
        let at = folder.map_or(String::new(), |folder| format!("Results: {}\n", folder.display()));
        out!("{text}{at}");
    }
    if common.json {
        print_json_text(json);
    }
}
