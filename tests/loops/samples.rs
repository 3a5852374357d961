//! The samples of every shipped scene are the bytes that they have always been: `samples.sha256` has the
//! hashes of three segments of each, and of each station and front end where there are several. A change of
//! the signal chain that changes them says so there, and in the changelog why they were wrong before.

use std::path::Path;
use std::process::Command;

use study::sweep::sha256_hex;

#[test]
fn the_samples_of_every_shipped_scene_are_the_bytes_that_they_were() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let place = tempfile::tempdir().unwrap();
    let (mut changed, mut scenes) = (Vec::new(), std::collections::BTreeSet::new());
    for line in include_str!("../samples.sha256").lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (&[hash, scenario, seek, samples], of_it) = words.split_first_chunk().unwrap();
        let (stations, front_ends): (Vec<&str>, Vec<&str>) =
            of_it.iter().partition(|word| word.starts_with("station="));
        let out = place.path().join("samples.sigmf-data");
        let done = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
            .current_dir(root)
            .args(["generate", scenario, "--seek", seek, "--samples", samples, "--out"])
            .arg(&out)
            .args(stations.iter().map(|name| format!("--{name}")))
            .args(front_ends.iter().flat_map(|name| ["--front-end", *name]))
            .output()
            .unwrap();
        assert!(done.status.success(), "{line}: {}", String::from_utf8_lossy(&done.stderr));
        scenes.insert(scenario.to_owned());
        if sha256_hex(&std::fs::read(&out).unwrap()) != hash {
            changed.push(line);
        }
    }
    assert!(changed.is_empty(), "{changed:#?}");
    // A scene that is shipped is one that is held to its bytes; limits are no scene.
    for entry in std::fs::read_dir(root.join("scenarios")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let is_scene = name.ends_with(".toml") && name != "limits.toml";
        assert!(!is_scene || scenes.contains(&format!("scenarios/{name}")), "no hashes of {name}");
    }
}
