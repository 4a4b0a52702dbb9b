//! What the program is built of: allowed licences, sources and duplicates, as `deny.toml` has them. It holds where `cargo deny`,
//! which says more, is not installed; advisories need the network and are left to it.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// Packages that dependencies want in several versions. Each costs time to build and to audit: what comes to the list should
/// do so knowingly.
const SEVERAL: [&str; 8] = [
    "getrandom",
    "hashbrown",
    "itertools",
    "strsim",
    "syn",
    "thiserror",
    "thiserror-impl",
    "unicode-width",
];

/// A package that is built.
struct Package {
    name: String,
    version: String,
    /// Where it comes from, if that is not the registry.
    elsewhere: Option<String>,
    licence: String,
}

/// What is built on this machine, tests and benchmarks included.
fn packages() -> Vec<Package> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--offline", "--no-dedupe", "--prefix", "none"])
        .args(["--edges", "normal,build,dev", "--format", "{p}|{l}"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let tree = String::from_utf8(output.stdout).expect("a tree");
    let lines: BTreeSet<&str> = tree.lines().collect();
    lines
        .into_iter()
        .map(|line| {
            let (package, licence) = line.split_once('|').expect("a package and its licence");
            let mut words = package.splitn(3, ' ');
            let mut word = || words.next().map(str::to_owned);
            Package {
                name: word().expect("a name"),
                version: word().expect("a version"),
                elsewhere: word().filter(|w| w != "(proc-macro)"),
                // Some write a slash for "or", as was usual once.
                licence: licence.replace('/', " OR "),
            }
        })
        .collect()
}

/// Whether a licence is among those that the file for `cargo deny` allows.
fn allows(licence: &str) -> bool {
    let deny: toml::Table = toml::from_str(include_str!("../../deny.toml")).expect("TOML");
    let list = deny["licenses"]["allow"].as_array().expect("licences");
    let allowed: Vec<&str> = list.iter().filter_map(toml::Value::as_str).collect();
    let expression = spdx::Expression::parse(licence).unwrap_or_else(|e| panic!("{licence:?}: {e}"));
    expression.evaluate(|wanted| allowed.contains(&wanted.to_string().as_str()))
}

#[test]
fn licences_are_among_those_allowed() {
    let packages = packages();
    assert!(packages.len() > 100, "{} packages", packages.len());
    for package in packages {
        let (name, licence) = (package.name, package.licence);
        assert!(
            allows(&licence),
            "{name} is under {licence:?}, which is not allowed"
        );
    }
    assert!(!allows("GPL-3.0-only OR AGPL-3.0-only") && !allows("MIT AND GPL-3.0-only"));
}

#[test]
fn all_comes_from_the_registry() {
    for package in packages() {
        let own = package.name == env!("CARGO_PKG_NAME");
        assert_eq!(
            package.elsewhere.is_some(),
            own,
            "{} {:?}",
            package.name,
            package.elsewhere
        );
    }
}

#[test]
fn no_package_comes_twice_unnoticed() {
    let mut versions: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for package in packages() {
        versions.entry(package.name).or_default().insert(package.version);
    }
    for (name, versions) in versions {
        let several = versions.len() > 1;
        assert!(
            !several || SEVERAL.contains(&name.as_str()),
            "{name} in versions {versions:?}"
        );
    }
}
