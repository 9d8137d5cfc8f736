//! Rules of the workspace: allowed dependencies, file headers, unique names, plain words.

use serde_json::Value;
use softdock_kernels::fields::{Field, fields};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::params::Params;
use softdock_results::runs::RunsSchema;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the dependencies of each crate of the workspace, without those of tests and of optional features.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let mut command = Command::new(env!("CARGO"));
    command.args(["metadata", "--no-deps", "--format-version", "1", "--manifest-path"]).arg(root().join("Cargo.toml"));
    let metadata: Value = serde_json::from_slice(&command.output().expect("cargo").stdout).expect("cargo's JSON");
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let name = |value: &Value| value["name"].as_str().expect("a name").to_owned();
    let of = |package: &Value| {
        let used = list(&package["dependencies"]);
        (
            name(package),
            used.iter().filter(|used| used["kind"] != "dev" && used["optional"] != true).map(name).collect(),
        )
    };
    list(&metadata["packages"]).iter().map(of).collect()
}

#[test]
fn crate_dependencies_are_allowed() {
    let dependencies = dependencies();
    let own = |name: &str| {
        dependencies[name].iter().filter(|used| used.starts_with("softdock")).map(String::as_str).collect()
    };
    let allowed: [(&str, &[&str]); 22] = [
        ("softdock-input", &[]),
        ("softdock-tracer", &["softdock-kernels"]),
        ("softdock-engine", &["softdock-kernels", "softdock-tracer"]),
        ("softdock-realtime", &["softdock-kernels", "softdock-input", "softdock-campaign"]),
        (
            "softdock-session",
            &[
                "softdock-kernels",
                "softdock-input",
                "softdock-campaign",
                "softdock-results",
                "softdock-analysis",
                "softdock-realtime",
                "softdock-web",
            ],
        ),
        ("softdock-web", &[]),
        ("softdock-serve", &["softdock-input", "softdock-analysis", "softdock-farm", "softdock-web"]),
        ("softdock-export", &["softdock-kernels", "softdock-results", "softdock-realtime"]),
        ("softdock-mesh", &["softdock-kernels"]),
        ("softdock-campaign", &["softdock-kernels", "softdock-input", "softdock-mesh"]),
        ("softdock-results", &["softdock-kernels", "softdock-input"]),
        ("softdock-analysis", &["softdock-kernels", "softdock-campaign", "softdock-results"]),
        (
            "softdock-farm",
            &[
                "softdock-kernels",
                "softdock-input",
                "softdock-tracer",
                "softdock-engine",
                "softdock-campaign",
                "softdock-results",
                "softdock-analysis",
            ],
        ),
        (
            "softdock-diagnosis",
            &[
                "softdock-kernels",
                "softdock-input",
                "softdock-engine",
                "softdock-campaign",
                "softdock-results",
                "softdock-analysis",
            ],
        ),
        // It reads recordings and renders pages as the diagnosis does.
        (
            "softdock-identify",
            &[
                "softdock-kernels",
                "softdock-input",
                "softdock-engine",
                "softdock-campaign",
                "softdock-results",
                "softdock-analysis",
                "softdock-diagnosis",
            ],
        ),
        // It reads recordings as the diagnosis does, and robots from URDF.
        ("softdock-rig-init", &["softdock-kernels", "softdock-campaign", "softdock-diagnosis"]),
        // Only the command may depend on the scored test set, which alone depends on both sides.
        (
            "softdock-bench",
            &[
                "softdock-kernels",
                "softdock-input",
                "softdock-campaign",
                "softdock-results",
                "softdock-analysis",
                "softdock-diagnosis",
                "softdock-gauntlet",
            ],
        ),
        // It generates the test data of the diagnosis: code shared with the diagnosis would bias the score.
        ("softdock-gauntlet", &[]),
        ("softdock-test-size", &[]),
        // An empty stand-in.
        ("criterion", &[]),
        ("softdock-python", &["softdock", "softdock-campaign", "softdock-engine", "softdock-farm", "softdock-results"]),
        ("softdock-oracle-rapier", &["softdock-kernels", "softdock-campaign", "softdock-identify"]),
    ];
    for (name, allowed) in allowed {
        let known: Vec<&str> = own(name);
        assert!(known.iter().all(|used| allowed.contains(used)), "{name} knows {known:?}");
    }
    assert!(
        dependencies["softdock-kernels"].is_empty(),
        "the kernels depend on {:?}",
        dependencies["softdock-kernels"]
    );
    assert_eq!(dependencies.len(), allowed.len() + 2, "a new crate needs its arrows here: {:?}", dependencies.keys());
}

#[test]
fn heavy_libraries_have_one_owner() {
    for (library, owner) in [
        ("wgpu", "softdock-engine"),
        ("arrow", "softdock-results"),
        ("parquet", "softdock-results"),
        ("tokio", "softdock-web"),
        ("parry3d", "softdock-mesh"),
        ("pyo3", "softdock-python"),
    ] {
        for (name, used) in dependencies() {
            let names = used.iter().any(|used| used.split('-').next() == Some(library));
            assert_eq!(names, name == owner, "{library} in {name}");
        }
    }
}

/// Returns all Rust files of the workspace.
fn sources() -> Vec<PathBuf> {
    ["kernels", "host", "python", "tests"].iter().flat_map(|folder| sources_in(&root().join(folder))).collect()
}

/// Returns all Rust files below a folder.
fn sources_in(folder: &Path) -> Vec<PathBuf> {
    let mut open = vec![folder.to_owned()];
    let mut files = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    files
}

/// Returns the modules of a crate that each of its modules imports by `crate::`, without tests; a folder counts as one
/// module.
fn imports(source: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let mut imports: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in sources_in(source) {
        let path = file.strip_prefix(source).expect("a file below the folder").with_extension("");
        let parts: Vec<String> = path.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        if ["lib", "main"].contains(&parts[0].as_str()) || parts.iter().any(|p| p.contains("tests") || p == "fuzz") {
            continue;
        }
        let text = fs::read_to_string(&file).expect("a text");
        let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        let lines = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let text: String = lines.flat_map(|line| [line, "\n"]).collect();
        imports.entry(parts[0].clone()).or_default().extend(text.split("crate::").skip(1).flat_map(named));
    }
    let modules: BTreeSet<String> = imports.keys().cloned().collect();
    for (module, named) in &mut imports {
        named.retain(|name| modules.contains(name) && name != module);
    }
    imports
}

/// Returns the modules after `crate::`: one, or several in braces.
fn named(rest: &str) -> Vec<String> {
    let word =
        |text: &str| text.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default().to_owned();
    let Some(list) = rest.strip_prefix('{') else { return vec![word(rest)] };
    let (mut depth, mut names, mut start) = (1, Vec::new(), 0);
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 1 => {
                names.push(word(list[start..at].trim()));
                start = at + 1;
            }
            _ => {}
        }
        if depth == 0 {
            names.push(word(list[start..at].trim()));
            break;
        }
    }
    names
}

/// Modules with circular imports, by crate. The lists may only shrink; that of kernels vanishes with its
/// rebuild.
const CIRCLES: [(&str, &[&str]); 2] = [
    ("kernels/src", &["contact", "fixture", "manipulator", "model", "plant", "robot", "session", "space", "start"]),
    (
        "tests/gauntlet/src",
        &[
            "body",
            "catalogue",
            "command",
            "contact",
            "drive",
            "error",
            "facility",
            "instrument",
            "robot",
            "sensor",
            "session",
        ],
    ),
];

/// Returns whether a module imports itself through others.
fn is_in_circle(imports: &BTreeMap<String, BTreeSet<String>>, module: &str) -> bool {
    let mut open: Vec<&String> = imports[module].iter().collect();
    let mut seen: BTreeSet<&String> = BTreeSet::new();
    while let Some(next) = open.pop() {
        if next == module {
            return true;
        }
        if seen.insert(next) {
            open.extend(&imports[next]);
        }
    }
    false
}

#[test]
fn modules_import_one_way() {
    let hosts = fs::read_dir(root().join("host")).expect("a folder").flatten();
    let hosts = hosts.map(|entry| format!("host/{}/src", entry.file_name().to_string_lossy()));
    let others =
        ["kernels/src", "kernels/tracer/src", "tests/gauntlet/src", "host/cli", "python/src"].map(str::to_owned);
    let mut crates = 0;
    for source in hosts.chain(others).filter(|source| root().join(source).is_dir()) {
        crates += 1;
        let imports = imports(&root().join(&source));
        let in_circles: Vec<&str> =
            imports.keys().filter(|module| is_in_circle(&imports, module)).map(String::as_str).collect();
        let known = CIRCLES.iter().find(|(name, _)| *name == source).map_or(&[][..], |(_, modules)| modules);
        let new: Vec<_> = in_circles.iter().filter(|module| !known.contains(module)).collect();
        assert!(new.is_empty(), "{source}: these modules import in a circle: {new:?}");
        let gone: Vec<_> = known.iter().filter(|module| !in_circles.contains(module)).collect();
        assert!(gone.is_empty(), "{source}: no longer in a circle, so take them off the list: {gone:?}");
    }
    assert!(crates > 12, "{crates} crates");
}

/// Files that may open others without `softdock-input`, because they read no user input.
const OPENERS: [&str; 5] = [
    "host/input/src/file.rs",
    // The system's own files, and the lock of a robot.
    "host/realtime/src/process.rs",
    "host/realtime/src/process/owner.rs",
    // Locks of a results folder.
    "host/farm/src/lock.rs",
    // A folder that is synced.
    "host/results/src/atomic.rs",
];

#[test]
fn files_of_users_are_opened_within_bounds() {
    for file in sources() {
        let name = file.strip_prefix(root()).expect("below the root").to_string_lossy().replace('\\', "/");
        let is_test = name.contains("/tests/") || name.ends_with("tests.rs");
        if !name.starts_with("host/") || is_test || OPENERS.contains(&name.as_str()) {
            continue;
        }
        let text = fs::read_to_string(&file).expect("a text");
        let program = text.split("#[cfg(test)]").next().unwrap_or_default();
        for call in ["fs::read(", "fs::read_to_string(", "File::open("] {
            assert!(!program.contains(call), "{name} calls {call}: use softdock_input::read, read_text or open");
        }
    }
}

#[test]
fn every_source_file_has_a_module_doc() {
    let files = sources();
    assert!(files.len() > 50, "{} files", files.len());
    for file in files {
        let text = fs::read_to_string(&file).expect("a text");
        assert!(text.starts_with("//! "), "{} does not open with a sentence", file.display());
    }
}

#[test]
fn field_names_are_unique() {
    let unique = |names: Vec<String>| {
        let set: BTreeSet<&String> = names.iter().collect();
        assert_eq!(set.len(), names.len(), "{names:?}");
    };
    let names = |fields: Vec<Field>| fields.into_iter().map(|field| field.name).collect();
    unique(names(fields::<f64, Params<f64>>()));
    unique(names(fields::<f64, Metrics<f64>>()));
    unique(
        RunsSchema::new(Vec::new(), Vec::new(), Vec::new())
            .table(&[])
            .columns
            .into_iter()
            .map(|column| column.name)
            .collect(),
    );
}

#[test]
fn map_in_architecture_names_existing_paths() {
    let page = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let map = page.split("## Map").nth(1).and_then(|rest| rest.split("```").nth(1)).expect("a map in a code block");
    let paths: Vec<&str> =
        map.lines().filter_map(|line| line.split_whitespace().next()).filter(|w| *w != "text").collect();
    assert!(paths.len() > 10, "{paths:?}");
    for path in paths {
        assert!(root().join(path).exists(), "ARCHITECTURE.md names {path}");
    }
}

/// Returns the name of the public type that a line declares, if it declares one.
fn public_type(line: &str) -> Option<String> {
    let rest = line.trim_start().strip_prefix("pub ")?;
    let name = ["struct ", "enum ", "trait ", "type "].iter().find_map(|kind| rest.strip_prefix(kind))?;
    let name: String = name.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    name.starts_with(char::is_uppercase).then_some(name)
}

#[test]
fn public_type_names_are_unique() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for file in ["kernels", "host"].iter().flat_map(|folder| sources_in(&root().join(folder))) {
        let text = fs::read_to_string(&file).expect("a text");
        for name in text.lines().filter_map(public_type) {
            places
                .entry(name)
                .or_default()
                .push(file.strip_prefix(root()).expect("below the root").display().to_string());
        }
    }
    assert!(places.len() > 500, "{} public types", places.len());
    let repeated: Vec<_> = places.iter().filter(|(_, files)| files.len() > 1).collect();
    assert!(repeated.is_empty(), "public types with the same name; choose a more specific one: {repeated:#?}");
}

/// Words with a standard term of the field in their place: `docs` and comments use the term.
const VAGUE_WORDS: [&str; 7] = ["told", "tell", "tells", "eased", "relieved", "embellished", "restless"];

/// Returns the Rust lines of a folder that contain one of [`VAGUE_WORDS`] as a whole word, with file and line number.
fn vague_lines(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    for file in sources_in(&root().join(folder)) {
        let name = file.strip_prefix(root()).expect("below the root").display().to_string();
        // The list of the words themselves.
        if name.ends_with("workspace_rules.rs") {
            continue;
        }
        let text = fs::read_to_string(&file).expect("a text");
        let words = |line: &str| -> Vec<String> {
            line.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_lowercase).collect()
        };
        let vague = text
            .lines()
            .enumerate()
            .filter(|(_, line)| words(line).iter().any(|word| VAGUE_WORDS.contains(&word.as_str())));
        found.extend(vague.map(|(number, line)| format!("{name}:{}: {}", number + 1, line.trim())));
    }
    found.sort();
    found
}

#[test]
fn texts_use_plain_words() {
    let hosts = fs::read_dir(root().join("host")).expect("a folder").flatten();
    let hosts = hosts.map(|entry| format!("host/{}/src", entry.file_name().to_string_lossy()));
    let folders = hosts.chain(["kernels/src", "python/src", "tests"].map(str::to_owned));
    let folders: Vec<String> = folders.filter(|folder| root().join(folder).is_dir()).collect();
    assert!(folders.len() > 10, "{folders:?}");
    for folder in folders {
        // A stream of random numbers of a test has its name.
        let found: Vec<String> =
            vague_lines(&folder).into_iter().filter(|line| !line.contains("philox::uniform")).collect();
        assert!(
            found.is_empty(),
            "lines with {VAGUE_WORDS:?}; use report, command, state, separate:\n{}",
            found.join("\n")
        );
    }
}
