//! Scripts for engines, run by a real shell in directories with hostile names.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::*;

const NAMES: [&str; 6] = [
    "plain",
    "two words",
    "it's \"quoted\"",
    "$(touch gotcha) `touch gotcha`",
    "semi;colon & more > x",
    "new\nline \\ $HOME *",
];

/// Programs in place of an engine's; the PATH that finds them first.
fn tools(here: &Path, programs: &[(&str, &str)]) -> String {
    let tools = here.join("tools");
    fs::create_dir(&tools).unwrap();
    for (name, text) in programs {
        fs::write(tools.join(name), text).unwrap();
        assert!(Command::new("chmod").arg("+x").arg(tools.join(name)).status().unwrap().success());
    }
    format!("{}:{}", tools.display(), std::env::var("PATH").unwrap())
}

#[test]
fn scripts_run_their_shards_whatever_the_directory_is_called() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 18"));
    // Stands for GNU parallel: runs the last word for each line of its input, one after the other.
    let parallel = "#!/bin/bash\nwhile read -r word; do \"${!#}\" \"$word\" </dev/null || exit; done\n";
    let path = tools(here.path(), &[("parallel", parallel), ("scontrol", "#!/bin/bash\necho \"$@\" >>requeued\n")]);
    let script = |engine: &str, directory: &str, variables: &[(&str, &str)]| {
        // Where there is no scontrol, or one that says nothing, arrays have Slurm's default size.
        let text = good(&["export", engine, directory, "--tasks", "4"], here.path());
        fs::write(here.path().join("script"), &text).unwrap();
        let mut bash = Command::new("bash");
        let output = bash.arg("script").current_dir(here.path()).env("PATH", &path).envs(variables.iter().copied());
        (text, output.output().unwrap())
    };
    for name in NAMES {
        good(&["plan", "study.toml", "-o", name, "--shards", "4"], here.path());
        let (text, ran) = script("slurm", name, &[("SLURM_ARRAY_TASK_ID", "2")]);
        assert!(ran.status.success() && text.contains("--array=0-3\n"), "{name}: {}", super::text(&ran));
        assert_eq!(shards(here.path(), name).len(), 1, "{name}");
        let (text, ran) = script("parallel", name, &[]);
        assert!(ran.status.success() && text.contains("\n0\n1\n3\n"), "{name}: {}", super::text(&ran));
        assert!(good(&["status", name], here.path()).contains("4 of 4 shards are whole"), "{name}");
    }
    assert!(!here.path().join("gotcha").exists() && !here.path().join("requeued").exists());
    let nothing = study(&["export", "slurm", "plain"], here.path());
    assert_eq!(code(&nothing), 65, "{}", super::text(&nothing));
}

#[test]
fn a_task_of_an_engine_knows_its_shard_by_itself() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 18"));
    good(&["plan", "study.toml", "-o", "task", "--shards", "4"], here.path());
    let auto = |value: Option<&str>| {
        let mut run = command(&["run", "task", "--shard", "auto"], here.path());
        run.env_remove("SLURM_ARRAY_TASK_ID").envs(value.map(|value| ("SLURM_ARRAY_TASK_ID", value)));
        code(&run.output().unwrap())
    };
    assert_eq!((auto(None), auto(Some("x")), auto(Some("4"))), (2, 2, 2));
    assert_eq!((auto(Some("3")), auto(Some("3"))), (0, 0));
    let status = study(&["status", "task", "--missing"], here.path());
    assert_eq!((code(&status), String::from_utf8_lossy(&status.stdout).trim()), (3, "0-2"));
}

/// Runs the first half of an array, as an engine that loses the rest; its first answer is that it is busy.
const LOSING: &str = r#"#!/bin/bash
[ -e asked ] || { touch asked; echo "sbatch: error: Socket timed out" >&2; exit 1; }
script=${!#}
words=$(grep -oP '(?<=--array=)[^%]*' "$script" | tr , '\n' | sed 's/-/ /' | while read -r a b; do seq "$a" "${b:-$a}"; done)
half=$((($(wc -w <<<"$words") + 1) / 2))
for word in $(head -$half <<<"$words"); do SLURM_ARRAY_TASK_ID=$word bash "$script" >/dev/null; done
echo "17;cluster"
"#;

#[test]
fn what_an_engine_loses_is_submitted_again_until_nothing_is_missing() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 18"));
    let path = tools(
        here.path(),
        &[
            ("sbatch", LOSING),
            ("squeue", "#!/bin/bash\nexit 0\n"),
            ("scancel", "#!/bin/bash\necho \"$@\" >>cancelled\n"),
            ("scontrol", "#!/bin/bash\necho 'MaxArraySize            = 5'\n"),
        ],
    );
    let submit = |arguments: &[&str]| {
        let mut command = command(&[&["submit", "lost", "--engine", "slurm"], arguments].concat(), here.path());
        command.env("PATH", &path).output().unwrap()
    };
    good(&["plan", "study.toml", "-o", "lost", "--shards", "10"], here.path());
    // A controller that does not answer: try again.
    let busy = submit(&[]);
    assert!(code(&busy) == 75 && super::text(&busy).contains("Socket timed out"), "{}", super::text(&busy));
    let once = submit(&["--rounds", "1"]);
    assert_eq!(code(&once), 3, "{}", super::text(&once));
    // Five tasks at most, two shards each, of which three were run.
    let script = fs::read_to_string(here.path().join("lost/submit/round-1.sh")).unwrap();
    assert!(script.contains("--array=0-4\n") && script.contains("/5\""), "{script}");
    assert!(super::text(&once).contains("missing: 6-9"), "{}", super::text(&once));
    let rest = submit(&[]);
    assert_eq!(code(&rest), 0, "{}", super::text(&rest));
    assert!(super::text(&rest).contains("10 of 10 shards are whole after 2 rounds"), "{}", super::text(&rest));
    assert_eq!(merged(here.path(), "lost"), {
        good(&["plan", "study.toml", "-o", "local", "--shards", "3"], here.path());
        good(&["run", "local"], here.path());
        merged(here.path(), "local")
    });
    // Nothing is missing: nothing is submitted.
    assert!(super::text(&submit(&[])).contains("after 0 rounds"));
}

#[test]
fn a_job_that_an_earlier_submission_left_is_waited_for_and_a_held_one_is_taken_away() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 18"));
    let path = tools(
        here.path(),
        &[
            ("sbatch", "#!/bin/bash\ntouch submitted\necho 18\n"),
            // Waits once, then is held by a controller that was started again, until it is cancelled.
            (
                "squeue",
                "#!/bin/bash\n[ -e looked ] || { touch looked; echo 'PENDING|Priority'; exit; }\n[ -e cancelled ] || \
                 echo 'PENDING|launch failed requeued held'\n",
            ),
            ("scancel", "#!/bin/bash\necho \"$@\" >>cancelled\n"),
        ],
    );
    good(&["plan", "study.toml", "-o", "held", "--shards", "4"], here.path());
    fs::create_dir(here.path().join("held/submit")).unwrap();
    fs::write(here.path().join("held/submit/job"), "17\n").unwrap();
    let mut command = command(&["submit", "held", "--engine", "slurm", "--rounds", "1"], here.path());
    let ended = command.env("PATH", &path).output().unwrap();
    assert_eq!(code(&ended), 3, "{}", super::text(&ended));
    assert_eq!(fs::read_to_string(here.path().join("cancelled")).unwrap(), "17\n");
    assert!(here.path().join("submitted").exists());
}

#[test]
fn directives_that_are_none_and_a_missing_engine_are_refused_by_name() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 18"));
    good(&["plan", "study.toml", "-o", "site", "--shards", "4"], here.path());
    let text = good(
        &["export", "slurm", "site", "--directive=--partition=long", "--minutes", "7", "--at-once", "2"],
        here.path(),
    );
    for line in ["--partition=long\n", "--time=7\n", "--array=0-3%2\n", "--open-mode=append\n", "/log/%A_%a\"\n"] {
        assert!(text.contains(&format!("#SBATCH {line}")) || text.contains(line), "{line:?} in {text}");
    }
    let none = study(&["export", "slurm", "site", "--directive", "partition=long"], here.path());
    assert!(code(&none) == 2 && super::text(&none).contains("expected an option of sbatch"), "{}", super::text(&none));
    let mut command = command(&["submit", "site", "--engine", "slurm"], here.path());
    let alone = command.env("PATH", "/nowhere").output().unwrap();
    assert!(code(&alone) == 75 && super::text(&alone).contains("cannot run sbatch"), "{}", super::text(&alone));
}
