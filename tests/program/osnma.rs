//! `osnma verify`: results and refusals on a recording that is signed with test keys.

#[allow(dead_code, reason = "the crate's own tests use the rest")]
#[path = "../../src/osnma/tests/signed.rs"]
mod signed;

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use osnma::bits::hex;
use osnma::chain::{Hash, MacFunction};
use osnma::fields::NmaHeader;
use osnma::page::Page;
use signed::{Signed, parts, point, root, sky};

/// Runs the program, and gives its exit code, its results and its messages.
fn twin(directory: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gnss-twin"));
    command.args(["osnma", "verify"]).args(arguments).current_dir(directory).stdin(Stdio::null());
    let Output { status, stdout, stderr } = command.output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
}

fn row(page: &Page, word: u128) -> String {
    let (even, odd) = parts(word, page.hkroot(), page.mack());
    format!("{},{},{},{even:030X}{odd:030X}\n", page.start.tow_s(), page.start.week(), page.sender)
}

/// Twelve minutes of four satellites; each word goes through `change`.
fn recording(change: impl Fn(&Page) -> u128) -> String {
    let signed = Signed::new(1, Hash::Sha256, MacFunction::HmacSha256);
    sky(&signed, NmaHeader(0b1001_0010), 0, 24).iter().map(|page| row(page, change(page))).collect()
}

fn key_file(id: u8) -> String {
    let point = hex(&point(id));
    format!(
        "<a>\n<PublicKey><i>0</i><PKID>{id}</PKID><point>{point}</point><PKType>ECDSA P-256/SHA-256</PKType></PublicKey></a>"
    )
}

#[test]
fn a_scene_s_pages_are_authentic_with_the_keys_that_its_truth_has() {
    let here = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/osnma.toml");
    let scene = scene.to_str().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gnss-twin"));
        command.args(arguments).current_dir(here.path()).stdin(Stdio::null()).output().unwrap()
    };
    let made = run(&["generate", scene, "--samples", "4096", "--out", "some.sigmf-data", "--quiet"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let pages = run(&["osnma", "pages", scene]);
    // Nine satellites, and the pages of 150 s.
    assert_eq!(pages.stdout.iter().filter(|&&byte| byte == b'\n').count(), 9 * 75);
    fs::write(here.path().join("pages.csv"), pages.stdout).unwrap();
    let key = ["--public-key", "some.truth/osnma_test_public_key.xml"];
    let kroot = ["--kroot", "some.truth/osnma_test_kroot.hex", "--json"];
    let (code, text, said) = twin(here.path(), &[&["pages.csv"][..], &key, &kroot].concat());
    assert_eq!((code, said.as_str()), (Some(0), ""));
    let object: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&object["start"], &object["first_authentic_after_s"]), (&"hot".into(), &91.into()));
    let refused = run(&["osnma", "pages", scene, "--spoofer", "1"]);
    assert_eq!(refused.status.code(), Some(2));
}

/// A directory with a recording, a public key, and the digits of the tree's root.
fn bench() -> (tempfile::TempDir, String) {
    let here = tempfile::tempdir().unwrap();
    fs::write(here.path().join("pages.csv"), recording(Page::word)).unwrap();
    fs::write(here.path().join("key.xml"), key_file(1)).unwrap();
    (here, hex(&root().0))
}

#[test]
fn a_signed_recording_is_authentic_from_each_start_and_packed_or_not() {
    let (here, root) = bench();
    let read = |name: &str| fs::read_to_string(here.path().join(name)).unwrap();
    let (code, text, said) = twin(here.path(), &["pages.csv", "--merkle-root", &root, "--out", "cold"]);
    assert_eq!((code, said.as_str()), (Some(0), ""));
    assert!(text.contains("4 satellites") && text.contains("0 refused") && text.contains("state         authentic"));
    let table = read("cold/osnma.csv");
    assert!(table.starts_with("gst_week,tow_s,sender,satellite,adkd,position,result,reason\n"));
    assert_eq!(table.lines().count(), 1 + 24 * 24);
    assert!(table.contains("1300,36600,E05,E05,0,1,authentic,\n"));
    assert!(table.contains(",not_verifiable,no later key received\n"));
    // A directory of its own is replaced; the packed recording gives the same rows.
    let packed = fs::File::create(here.path().join("pages.csv.gz")).unwrap();
    let mut packed = flate2::write::GzEncoder::new(packed, flate2::Compression::fast());
    packed.write_all(read("pages.csv").as_bytes()).unwrap();
    packed.finish().unwrap();
    assert_eq!(twin(here.path(), &["pages.csv.gz", "--merkle-root", &root, "--out", "cold", "--quiet"]).0, Some(0));
    assert_eq!(read("cold/osnma.csv"), table);
    let object = |arguments: &[&str]| -> serde_json::Value {
        let (code, text, said) = twin(here.path(), arguments);
        assert_eq!(code, Some(0), "{said}");
        serde_json::from_str(&text).unwrap()
    };
    let warm = object(&["pages.csv", "--public-key", "key.xml", "--json"]);
    assert_eq!((&warm["start"], &warm["keys"]["verified"]), (&"warm".into(), &24.into()));
    let hot = object(&["pages.csv", "--public-key", "key.xml", "--kroot", "cold/kroot.hex", "--json"]);
    assert_eq!((&hot["start"], &hot["first_authentic_after_s"]), (&"hot".into(), &89.into()));
    assert!(warm["first_authentic_after_s"].as_u64() > Some(89));
}

#[test]
fn forged_data_a_wrong_key_and_a_wrong_clock_end_with_three() {
    let (here, root) = bench();
    let forged = |page: &Page| page.word() ^ if page.sender == 5 && page.index() == 5 { 1 << 40 } else { 0 };
    fs::write(here.path().join("forged.csv"), recording(forged)).unwrap();
    let (code, text, said) = twin(here.path(), &["forged.csv", "--merkle-root", &root, "--out", "forged"]);
    assert!(code == Some(3) && said.contains("refused: ") && said.contains(" tags"), "{said}");
    assert!(text.contains("tag is not the MAC of the data"), "{text}");
    // The rows are written all the same, and none about the forged data is authentic.
    let table = fs::read_to_string(here.path().join("forged/osnma.csv")).unwrap();
    let of_forged = |row: &&str| row.split(',').nth(3) == Some("E05") && row.split(',').nth(4) != Some("4");
    assert!(table.lines().filter(of_forged).all(|row| !row.contains(",authentic,")));
    let other = key_file(2).replace("<PKID>2", "<PKID>1");
    fs::write(here.path().join("other.xml"), other).unwrap();
    let (code, _, said) = twin(here.path(), &["pages.csv", "--public-key", "other.xml"]);
    assert!(code == Some(3) && said.contains("DSM-KROOT (forged, or the public key is another)"), "{said}");
    let (code, _, said) = twin(here.path(), &["pages.csv", "--merkle-root", &"00".repeat(32)]);
    assert!(code == Some(3) && said.contains("DSM-PKR (forged, or the Merkle tree is another)"), "{said}");
    fs::write(here.path().join("second.xml"), key_file(2)).unwrap();
    let (code, _, said) = twin(here.path(), &["pages.csv", "--public-key", "second.xml"]);
    assert!(code == Some(3) && said.contains("no root key of the public key was received"), "{said}");
    let late = twin(here.path(), &["pages.csv", "--merkle-root", &root, "--clock-offset-s", "3600"]);
    assert!(late.0 == Some(3) && late.2.contains("see --clock-offset-s"), "{}", late.2);
    let vague = twin(here.path(), &["pages.csv", "--merkle-root", &root, "--time-uncertainty-s", "60", "--json"]);
    let object: serde_json::Value = serde_json::from_str(&vague.1).unwrap();
    assert_eq!(object["tags"]["adkd_0"]["authentic"], 0);
    assert!(object["tags"]["adkd_12"]["authentic"].as_u64() > Some(0));
}

#[test]
fn bad_input_is_refused_with_its_line_and_what_was_expected_and_nothing_is_written() {
    let (here, root) = bench();
    let put = |name: &str, text: &[u8]| fs::write(here.path().join(name), text).unwrap();
    let good = recording(Page::word);
    let lines: Vec<&str> = good.lines().collect();
    put("empty.csv", b"");
    put("text.csv", b"time,sv\n");
    put("bytes.csv", &[0xff; 40]);
    put("zip.csv", b"PK\x03\x04 and more than sixteen bytes");
    put("cut.csv.gz", &[0x1f, 0x8b, 8, 0, 0, 0]);
    put("short.csv", format!("{}\n{}\n", lines[0], &lines[1][..40]).as_bytes());
    put("order.csv", format!("{}\n{}\n", lines[30], lines[0]).as_bytes());
    put("tree.xml", b"<a><MerkleTree></MerkleTree></a>");
    put("no.xml", b"<a>\n<b></a>");
    put("kroot.hex", b"12345\n");
    let long = "ab".repeat(33);
    let by_root: [(&str, i32, &str); 8] = [
        ("absent.csv", 65, "absent.csv: No such file"),
        (".", 65, "directory"),
        ("empty.csv", 65, "no page in it: expected rows TOW,WN,SV,page"),
        ("text.csv", 65, "text.csv:1: expected 4 cells"),
        ("bytes.csv", 65, "bytes.csv:1: not a text"),
        ("zip.csv", 65, "packed by zip"),
        ("short.csv", 65, "short.csv:2: page: expected 60 hexadecimal digits"),
        ("order.csv", 65, "order.csv:2: week 1300 TOW 36001 after week 1300 TOW 36015"),
    ];
    let by_root = by_root.map(|(file, code, part)| (vec![file, "--merkle-root", root.as_str()], code, part));
    let others: [(Vec<&str>, i32, &str); 12] = [
        (vec!["cut.csv.gz", "--merkle-root", &root], 65, "damaged gzip data"),
        (vec!["pages.csv"], 2, "--merkle-root"),
        (vec!["pages.csv", "--merkle-root", &root, "--public-key", "key.xml"], 2, "cannot be used with"),
        (vec!["pages.csv", "--merkle-root", &long], 2, "expected 64 hexadecimal digits, found 66"),
        (vec!["pages.csv", "--merkle-root", "key.xml"], 65, "key.xml: line 2: a file of a public key"),
        (vec!["pages.csv", "--public-key", "tree.xml"], 65, "give it with --merkle-root"),
        (vec!["pages.csv", "--merkle-root", "tree.xml"], 65, "<MerkleTree> without <HashFunction>"),
        (vec!["pages.csv", "--public-key", "no.xml"], 65, "no.xml: line 2: not XML"),
        (vec!["pages.csv", "--public-key", "key.xml", "--kroot", "kroot.hex"], 65, "kroot.hex:1: expected an even"),
        (vec!["pages.csv", "--merkle-root", &root, "--tag-bits", "0"], 2, "--tag-bits"),
        (vec!["pages.csv", "--merkle-root", &root, "--time-uncertainty-s", "nan"], 2, "expected seconds from 0"),
        (vec!["pages.csv", "--merkle-root", &root, "--out", "pages.csv"], 73, "pages.csv"),
    ];
    for (mut arguments, code, part) in by_root.into_iter().chain(others) {
        if !arguments.contains(&"--out") {
            arguments.extend(["--out", "x"]);
        }
        let (own, text, said) = twin(here.path(), &arguments);
        assert!(own == Some(code) && said.contains(part) && text.is_empty(), "{arguments:?}: {own:?}: {said}");
        assert!(!here.path().join("x").exists(), "{arguments:?}");
    }
}
