//! Settings of the verification of Galileo's message authentication (OSNMA).
//!
//! The table `[osnma]` turns verification on; without it nothing is verified. Keys are hexadecimal digits, or
//! names of files, which [`OsnmaSettings::read_files`] replaces by their digits. The receiver itself opens no
//! file.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::SettingsError;
use crate::described::described;
use osnma::bits::{hex, unhex};
use osnma::files;
use osnma::keys::{Anchor, MerkleRoot, PublicKey};
use osnma::verifier::Verifier;

/// Data that a position is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionData {
    /// All data that satellites send.
    All,
    /// Ephemerides that tags made authentic, and those alone.
    Authentic,
}

/// Start with the keys that a scene publishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneStart {
    /// Public key and root key.
    Hot,
    /// Public key.
    Warm,
    /// Root of the Merkle tree.
    Cold,
}

described! {
/// Settings of the verification of Galileo's message authentication.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OsnmaSettings {
    /// Cold start: root of the Merkle tree as 64 hexadecimal digits, or a file of the GSC (.xml). In a run of
    /// a scene with `[osnma]` the scene's own, unless a key is given here.
    pub merkle_root: String,
    /// Warm start: public key as its number and its point, `1:03…`, or a file of the GSC (.xml).
    pub public_key: String,
    /// Hot start: root key that an earlier reception stored, as hexadecimal digits or the file kroot.hex. It
    /// needs `public_key`, which signed it.
    pub kroot: String,
    /// Start with the keys of a scene, in a run of it without keys here. hot: public key and root key. warm:
    /// public key. cold: root of the Merkle tree.
    pub start: SceneStart,
    /// Bound of the error of the receiver's own time. Tags of ADKD 0 and 4 need less than 30 s, those of
    /// ADKD 12 less than 330 s.
    pub time_uncertainty_s: f64,
    /// Error of the receiver's own time: own less true. The own time is the start that the recording states,
    /// and counts samples; no signal sets it.
    pub clock_offset_s: f64,
    /// Bits of right tags after which data are authentic.
    pub tag_bits: u32,
    /// Data of the position. all: all that satellites send. authentic: ephemerides that tags made authentic,
    /// and those alone; there is no fix before.
    pub position: PositionData,
}
}

impl Default for OsnmaSettings {
    /// Bounds of the receiver guidelines 1.3, 4.2.
    fn default() -> Self {
        Self {
            merkle_root: String::new(),
            public_key: String::new(),
            kroot: String::new(),
            start: SceneStart::Hot,
            time_uncertainty_s: 15.0,
            clock_offset_s: 0.0,
            tag_bits: 40,
            position: PositionData::All,
        }
    }
}

/// Reads a value from what its key says, or the file of that name.
type Reader = fn(&str) -> Result<String, String>;

/// Keys whose value may be a file, with the values that they accept.
const KEYS: [(&str, &str, Reader); 3] = [
    ("osnma.merkle_root", "64 hexadecimal digits, or a file of the GSC (.xml)", |text| {
        files::merkle_root(text).map(|root| hex(&root.0)).map_err(|error| error.to_string())
    }),
    (
        "osnma.public_key",
        "a number from 1 to 15, a colon and 66 hexadecimal digits, or a file of the GSC (.xml)",
        |text| {
            files::key_point(text).map(|(id, point)| format!("{id}:{}", hex(&point))).map_err(|error| error.to_string())
        },
    ),
    ("osnma.kroot", "hexadecimal digits of a root key, or the file kroot.hex", |text| Ok(text.trim().to_owned())),
];

/// True for a value that can only be the name of a file.
fn is_file(value: &str) -> bool {
    value.contains(['.', '/', '\\'])
}

fn merkle_root(digits: &str) -> Option<MerkleRoot> {
    unhex(digits).ok()?.try_into().ok().map(MerkleRoot)
}

fn public_key(value: &str) -> Option<PublicKey> {
    let (number, point) = value.split_once(':')?;
    let id = number.parse().ok().filter(|id| (1..=15).contains(id))?;
    PublicKey::new(id, &unhex(point).ok()?).ok()
}

impl OsnmaSettings {
    /// Checks every value; names of files are taken as they are.
    ///
    /// # Errors
    /// Key, value and the values that are expected instead.
    pub(super) fn validate(&self) -> Result<(), (&'static str, String, String)> {
        let ranges = [
            ("osnma.time_uncertainty_s", self.time_uncertainty_s, 0.0, 1e9),
            ("osnma.clock_offset_s", self.clock_offset_s, -1e9, 1e9),
            ("osnma.tag_bits", f64::from(self.tag_bits), 20.0, 480.0),
        ];
        for (key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err((key, value.to_string(), format!("{low} to {high}")));
            }
        }
        let refuse = |key: usize, value: &str| Err((KEYS[key].0, format!("{value:?}"), KEYS[key].1.to_owned()));
        let is_open = |value: &str| value.is_empty() || is_file(value);
        if !is_open(&self.merkle_root) && merkle_root(&self.merkle_root).is_none() {
            return refuse(0, &self.merkle_root);
        }
        if !is_open(&self.public_key) && public_key(&self.public_key).is_none() {
            return refuse(1, &self.public_key);
        }
        if !is_open(&self.kroot) && unhex(&self.kroot).is_err() {
            return refuse(2, &self.kroot);
        }
        Ok(())
    }

    /// True if no key is given.
    pub fn has_no_anchor(&self) -> bool {
        self.merkle_root.is_empty() && self.public_key.is_empty() && self.kroot.is_empty()
    }

    /// Takes the keys that a scene publishes, as far as its start needs them, if none is given.
    pub fn or_keys(&mut self, root: &MerkleRoot, key: &PublicKey, kroot: &[u8]) {
        if !self.has_no_anchor() {
            return;
        }
        match self.start {
            SceneStart::Cold => self.merkle_root = hex(&root.0),
            SceneStart::Warm | SceneStart::Hot => self.public_key = format!("{}:{}", key.id, hex(&key.point())),
        }
        if self.start == SceneStart::Hot {
            self.kroot = hex(kroot);
        }
    }

    /// Replaces names of files, relative to a directory, by the keys in them. `origin` names the settings'
    /// file in errors, `above` the tables above `[osnma]`, with a dot behind each.
    ///
    /// # Errors
    /// A file that cannot be read or has no such key.
    pub fn read_files(&mut self, directory: &Path, origin: &str, above: &str) -> Result<(), SettingsError> {
        let values = [&mut self.merkle_root, &mut self.public_key, &mut self.kroot];
        for (value, (key, expected, read)) in values.into_iter().zip(KEYS) {
            if !is_file(value) {
                continue;
            }
            let text = fs::read_to_string(directory.join(&*value)).map_err(|error| error.to_string());
            *value = text.and_then(|text| read(&text)).map_err(|why| SettingsError::Range {
                origin: origin.to_owned(),
                above: above.to_owned(),
                key,
                value: format!("{value:?}"),
                expected: format!("{expected}: {why}"),
            })?;
        }
        Ok(())
    }

    /// Trust of the receiver at its start, with the start's name: cold, warm or hot. The newest start that
    /// the keys allow is taken.
    ///
    /// # Errors
    /// Keys that are missing, and keys that contradict each other, in words.
    pub(crate) fn anchor(&self) -> Result<(Anchor, &'static str), String> {
        if let Some((name, value)) = [("merkle_root", &self.merkle_root), ("public_key", &self.public_key)]
            .into_iter()
            .find(|(_, value)| is_file(value))
        {
            return Err(format!("osnma.{name} = {value:?}: the file was not read: expected its digits"));
        }
        let key = (!self.public_key.is_empty()).then(|| public_key(&self.public_key).ok_or(KEYS[1])).transpose();
        let key = key.map_err(|(name, expected, _)| format!("{name} = {:?}: expected {expected}", self.public_key))?;
        if !self.kroot.is_empty() {
            let Some(key) = key else {
                return Err("osnma.kroot: a stored root key needs osnma.public_key, the key that signed it".to_owned());
            };
            let refuse = |why: String| format!("osnma.kroot: {why}: expected a root key that osnma.public_key signed");
            let bytes = unhex(&self.kroot).map_err(|_| refuse("not hexadecimal digits".to_owned()))?;
            let kroot = Verifier::root_of(&bytes).map_err(|error| refuse(error.to_string()))?;
            if kroot.key_id != key.id {
                return Err(refuse(format!("signed by public key {}, not {}", kroot.key_id, key.id)));
            }
            key.verify(&kroot).map_err(|error| refuse(error.to_string()))?;
            return Ok((Anchor::Root(key, Box::new(kroot)), "hot"));
        }
        if let Some(key) = key {
            return Ok((Anchor::Key(key), "warm"));
        }
        if self.merkle_root.is_empty() {
            return Err("[osnma] without a key to trust: expected osnma.merkle_root, osnma.public_key, or both \
                        osnma.public_key and osnma.kroot"
                .to_owned());
        }
        let root = merkle_root(&self.merkle_root);
        let root = root.ok_or_else(|| format!("osnma.merkle_root = {:?}: expected {}", self.merkle_root, KEYS[0].1))?;
        Ok((Anchor::Tree(root), "cold"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    const ROOT: &str = "0E63F552C8021709043C239032EFFE941BF22C8389032F5F2701E0FBC80148B8";
    const KEY: &str = "1:0374A925CFA0FF1805E5C5A58FDBA31BF0145D5B5BE2F062D3F8BB2EE98F0F6DB0";

    fn of(line: &str) -> Result<Settings, String> {
        Settings::parse(&format!("[osnma]\n{line}\n"), "rx.toml").map_err(|error| error.to_string())
    }

    #[test]
    fn each_key_makes_its_start_and_none_is_refused_by_name() {
        let start = |line: &str| of(line).unwrap().osnma.unwrap().anchor().map(|(_, start)| start);
        assert_eq!(start(&format!("merkle_root = '{ROOT}'")), Ok("cold"));
        assert_eq!(start(&format!("public_key = '{KEY}'")), Ok("warm"));
        assert!(start("").unwrap_err().contains("without a key to trust"));
        assert!(start("kroot = '00'").unwrap_err().contains("needs osnma.public_key"));
        assert!(start(&format!("public_key = '{KEY}'\nkroot = '52'")).unwrap_err().starts_with("osnma.kroot: "));
        assert!(start("merkle_root = 'tree.xml'").unwrap_err().contains("was not read"));
    }

    #[test]
    fn wrong_values_are_refused_at_their_line_with_what_is_expected() {
        for (line, expected) in [
            ("merkle_root = 'abc'", "rx.toml:2:1: osnma.merkle_root = \"abc\": expected 64 hexadecimal digits"),
            ("public_key = '16:03'", "rx.toml:2:1: osnma.public_key = \"16:03\": expected a number from 1 to 15"),
            ("time_uncertainty_s = -1", "rx.toml:2:1: osnma.time_uncertainty_s = -1: expected 0 to"),
            ("tag_bits = 7", "rx.toml:2:1: osnma.tag_bits = 7: expected 20 to 480"),
            ("position = 'some'", "rx.toml:2:1: osnma.position = \"some\": expected"),
            ("merkel_root = 'x'", "rx.toml:2:1: unknown key 'osnma.merkel_root': did you mean 'merkle_root'?"),
        ] {
            let error = of(line).unwrap_err();
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn files_give_their_digits_and_a_missing_one_is_named() {
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("kroot.hex"), "5200AB\n").unwrap();
        let mut settings = OsnmaSettings { kroot: "kroot.hex".to_owned(), ..OsnmaSettings::default() };
        settings.read_files(place.path(), "rx.toml", "").unwrap();
        assert_eq!(settings.kroot, "5200AB");
        settings.merkle_root = "tree.xml".to_owned();
        let error = settings.read_files(place.path(), "rx.toml", "receiver.").unwrap_err().to_string();
        assert!(error.starts_with("rx.toml: receiver.osnma.merkle_root = \"tree.xml\": expected 64"), "{error}");
    }

    #[test]
    fn without_the_table_nothing_is_written_of_it() {
        assert_eq!(Settings::parse("", "x").unwrap().osnma, None);
        assert!(!toml::to_string(&Settings::default()).unwrap().contains("osnma"));
        assert!(toml::to_string(&of("").unwrap()).unwrap().contains("[osnma]"));
    }
}
