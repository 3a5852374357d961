//! Scripts for engines, run by a real shell in directories with hostile names.

use std::fs;
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

#[test]
fn scripts_run_their_shards_whatever_the_directory_is_called() {
    let here = workplace(&MODELLED.replace("step = 2", "step = 18"));
    // Stands for GNU parallel: runs the command for each word behind ":::", one after the other.
    let tools = here.path().join("tools");
    fs::create_dir(&tools).unwrap();
    let stand_in = "#!/bin/bash\nrun=$1; shift 2\nfor word in \"$@\"; do \"$run\" \"$word\" || exit; done\n";
    fs::write(tools.join("parallel"), stand_in).unwrap();
    fs::write(tools.join("scontrol"), "#!/bin/bash\necho \"$@\" >>requeued\n").unwrap();
    for tool in ["parallel", "scontrol"] {
        assert!(Command::new("chmod").arg("+x").arg(tools.join(tool)).status().unwrap().success());
    }
    let path = format!("{}:{}", tools.display(), std::env::var("PATH").unwrap());
    let script = |engine: &str, directory: &str, variables: &[(&str, &str)]| {
        let text = good(&["export", engine, directory], here.path());
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
        assert!(ran.status.success() && text.contains("::: 0 1 3\n"), "{name}: {}", super::text(&ran));
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
