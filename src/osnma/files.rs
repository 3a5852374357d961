//! Key files of the European GNSS Service Centre: Merkle trees and public keys in XML.
//!
//! Source: OSNMA IDD ICD 1.1 as its files show it. A tree's file has the root as node j = 4, i = 0, and the
//! nodes beside the paths of the keys in it; those are held to the root. Limits: SHA-256 and ECDSA P-256
//! alone; signatures and certificates beside the files are not read.

use roxmltree::{Document, Node};
use thiserror::Error;

use crate::bits::unhex;
use crate::dsm::LEVELS;
use crate::keys::{MerkleRoot, PublicKey};

/// Reason for which a file has no key to trust.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum FileError {
    /// Text that is no XML.
    #[error("line {line}: not XML ({what})")]
    Xml {
        /// Line of the fault.
        line: u32,
        /// Description by the reader.
        what: String,
    },
    /// An element that must be there.
    #[error("line {line}: <{inside}> without <{missing}>, expected {expected}")]
    Missing {
        /// Line of the element around it.
        line: u32,
        /// Name of the element around it.
        inside: String,
        /// Name of the element.
        missing: &'static str,
        /// Expected content.
        expected: &'static str,
    },
    /// An element with another value.
    #[error("line {line}: {element} = {found:?}: expected {expected}")]
    Value {
        /// Line of the element.
        line: u32,
        /// Name of the element.
        element: &'static str,
        /// Text of the element.
        found: String,
        /// Expected content.
        expected: &'static str,
    },
    /// A file of the other kind.
    #[error("line {line}: a file of {found}: expected one of {expected}; give it with {flag}")]
    Other {
        /// Line of the element that shows it.
        line: u32,
        /// Kind of the file.
        found: &'static str,
        /// Kind that was asked for.
        expected: &'static str,
        /// Flag that takes such a file.
        flag: &'static str,
    },
    /// Nodes that contradict the root.
    #[error("line {line}: key {id} and the nodes beside its path do not lead to the root of the tree")]
    Path {
        /// Line of the key.
        line: u32,
        /// Number of the key.
        id: u8,
    },
}

/// Reads the root of a Merkle tree's file.
///
/// # Errors
/// [`FileError`].
pub fn merkle_root(text: &str) -> Result<MerkleRoot, FileError> {
    let document = parse(text)?;
    let Some(tree) = named(document.root(), "MerkleTree") else {
        return Err(match named(document.root(), "PublicKey") {
            Some(key) => FileError::Other {
                line: line(key),
                found: "a public key",
                expected: "a Merkle tree",
                flag: "--public-key",
            },
            None => missing(document.root_element(), "MerkleTree", "a Merkle tree of the GSC"),
        });
    };
    exactly(tree, "HashFunction", "SHA-256")?;
    exactly(tree, "N", "16")?;
    let node = |level: usize, index: usize| -> Result<Option<[u8; 32]>, FileError> {
        let is_it = |node: &Node<'_, '_>| {
            let value = |name| child(*node, name).ok().and_then(|child| text_of(child).parse::<usize>().ok());
            value("j") == Some(level) && value("i") == Some(index)
        };
        let found = tree.children().filter(|node| node.has_tag_name("TreeNode")).find(is_it);
        found.map(|node| digest(child(node, "x_ji")?)).transpose()
    };
    let root = MerkleRoot(
        node(LEVELS, 0)?.ok_or_else(|| missing(tree, "TreeNode", "the root of the tree, with j = 4 and i = 0"))?,
    );
    for key in tree.children().filter(|node| node.has_tag_name("PublicKey")) {
        let own = public_key(key)?;
        let index = number(child(key, "i")?, "i", 0, 15)?;
        let path: Vec<Option<[u8; 32]>> =
            (0..LEVELS).map(|level| node(level, usize::from(index >> level) ^ 1)).collect::<Result<_, _>>()?;
        let Some(path) = path.into_iter().collect::<Option<Vec<_>>>() else { continue };
        let leaf = [&[1 << 4 | own.id][..], &point(key)?].concat();
        if MerkleRoot::of(&leaf, index, &path) != root {
            return Err(FileError::Path { line: line(key), id: own.id });
        }
    }
    Ok(root)
}

/// Reads the key of a public key's file.
///
/// # Errors
/// [`FileError`].
pub fn key(text: &str) -> Result<PublicKey, FileError> {
    let document = parse(text)?;
    if let Some(tree) = named(document.root(), "MerkleTree") {
        return Err(FileError::Other {
            line: line(tree),
            found: "a Merkle tree",
            expected: "a public key",
            flag: "--merkle-root",
        });
    }
    let key = named(document.root(), "PublicKey")
        .ok_or_else(|| missing(document.root_element(), "PublicKey", "a public key of the GSC"))?;
    public_key(key)
}

/// Reads the key of a public key's file as its number and its point in compressed form.
///
/// # Errors
/// [`FileError`].
pub fn key_point(text: &str) -> Result<(u8, Vec<u8>), FileError> {
    let id = key(text)?.id;
    let document = parse(text)?;
    let node = named(document.root(), "PublicKey");
    let node = node.ok_or_else(|| missing(document.root_element(), "PublicKey", "a public key of the GSC"))?;
    Ok((id, point(node)?))
}

fn public_key(key: Node<'_, '_>) -> Result<PublicKey, FileError> {
    exactly(key, "PKType", "ECDSA P-256/SHA-256")?;
    let id = number(child(key, "PKID")?, "PKID", 1, 15)?;
    let element = child(key, "point")?;
    PublicKey::new(id, &point(key)?).map_err(|_| FileError::Value {
        line: line(element),
        element: "point",
        found: text_of(element).to_owned(),
        expected: "a point of P-256 in compressed form",
    })
}

fn point(key: Node<'_, '_>) -> Result<Vec<u8>, FileError> {
    let element = child(key, "point")?;
    unhex(text_of(element)).ok().filter(|bytes| bytes.len() == 33).ok_or_else(|| FileError::Value {
        line: line(element),
        element: "point",
        found: text_of(element).to_owned(),
        expected: "66 hexadecimal digits",
    })
}

fn digest(element: Node<'_, '_>) -> Result<[u8; 32], FileError> {
    let bytes = unhex(text_of(element)).ok().and_then(|bytes| <[u8; 32]>::try_from(bytes).ok());
    bytes.ok_or_else(|| FileError::Value {
        line: line(element),
        element: "x_ji",
        found: text_of(element).to_owned(),
        expected: "64 hexadecimal digits",
    })
}

fn parse(text: &str) -> Result<Document<'_>, FileError> {
    Document::parse(text).map_err(|error| FileError::Xml { line: error.pos().row, what: error.to_string() })
}

fn named<'a, 'b>(root: Node<'a, 'b>, name: &str) -> Option<Node<'a, 'b>> {
    root.descendants().find(|node| node.has_tag_name(name))
}

fn child<'a, 'b>(node: Node<'a, 'b>, name: &'static str) -> Result<Node<'a, 'b>, FileError> {
    node.children().find(|child| child.has_tag_name(name)).ok_or_else(|| missing(node, name, "one"))
}

fn exactly(node: Node<'_, '_>, name: &'static str, expected: &'static str) -> Result<(), FileError> {
    let element = child(node, name)?;
    let found = text_of(element);
    if found == expected {
        return Ok(());
    }
    Err(FileError::Value { line: line(element), element: name, found: found.to_owned(), expected })
}

fn number(node: Node<'_, '_>, name: &'static str, least: u8, most: u8) -> Result<u8, FileError> {
    let found = text_of(node);
    let value = found.parse().ok().filter(|value| (least..=most).contains(value));
    let expected = if least == 0 { "a number from 0 to 15" } else { "a number from 1 to 15" };
    value.ok_or_else(|| FileError::Value { line: line(node), element: name, found: found.to_owned(), expected })
}

fn text_of<'a>(node: Node<'a, '_>) -> &'a str {
    node.text().unwrap_or_default().trim()
}

/// Line of an element. Its name is a piece of the text, so their addresses give where it stands.
fn line(node: Node<'_, '_>) -> u32 {
    let text = node.document().input_text();
    let at = (node.tag_name().name().as_ptr() as usize).saturating_sub(text.as_ptr() as usize);
    let before = text.as_bytes().get(..at).unwrap_or_default();
    before.iter().fold(1, |line, &byte| line + u32::from(byte == b'\n'))
}

fn missing(node: Node<'_, '_>, missing: &'static str, expected: &'static str) -> FileError {
    FileError::Missing { line: line(node), inside: node.tag_name().name().to_owned(), missing, expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINT: &str = "0374A925CFA0FF1805E5C5A58FDBA31BF0145D5B5BE2F062D3F8BB2EE98F0F6DB0";
    /// Nodes beside the path of key 1 of the published tree of 2023, from the leaf on, and its root.
    const NODES: [(&str, &str); 5] = [
        ("<j>0</j><i>1</i>", "01631BDCED79D4317BC2870EE3895BD59CF2B6EA516FABBFDF1D739626146FFE"),
        ("<j>1</j><i>1</i>", "316FA9285F5A1E44042413BDAF18AA3CF684723397D7B8325AECA1EBCA9F0F64"),
        ("<j>2</j><i>1</i>", "9905424CBE482A1A32B01064F85D0C36DF038E52CE128E7EC5F323E165B182A7"),
        ("<j>3</j><i>1</i>", "1537BDB010972EB4A3B90BAACD14941EF40DA2CB2B82D378B315C008DECEFD8E"),
        ("<j>4</j><i>0</i>", "0E63F552C8021709043C239032EFFE941BF22C8389032F5F2701E0FBC80148B8"),
    ];

    fn public() -> String {
        format!(
            "<PublicKey><i>0</i><PKID>1</PKID><point>{POINT}</point><PKType>ECDSA P-256/SHA-256</PKType></PublicKey>"
        )
    }

    fn tree() -> String {
        let nodes = NODES.map(|(at, value)| format!("<TreeNode>{at}<x_ji>{value}</x_ji></TreeNode>\n")).concat();
        format!("<a><MerkleTree><N>16</N><HashFunction>SHA-256</HashFunction>\n{}\n{nodes}</MerkleTree></a>", public())
    }

    #[test]
    fn a_tree_gives_its_root_and_a_key_file_its_key() {
        assert_eq!(merkle_root(&tree()).unwrap().0[..2], [0x0e, 0x63]);
        assert_eq!(key(&format!("<a>{}</a>", public())).unwrap().id, 1);
        let (id, point) = key_point(&format!("<a>{}</a>", public())).unwrap();
        assert_eq!((id, point), (1, unhex(POINT).unwrap()));
    }

    #[test]
    fn a_wrong_file_is_refused_with_its_line_and_what_was_expected() {
        let refused = |text: &str| merkle_root(text).unwrap_err().to_string();
        assert!(refused("TOW,WN\n").starts_with("line 1: not XML"));
        assert!(refused("<a></a>").contains("<a> without <MerkleTree>"));
        assert!(refused(&public()).contains("give it with --public-key"));
        assert!(refused(&tree().replace("SHA-256</Hash", "SHA-1</Hash")).contains("HashFunction = \"SHA-1\""));
        assert!(refused(&tree().replace("<N>16", "<N>8")).contains("N = \"8\": expected 16"));
        assert!(refused(&tree().replace("0E63F", "0E63")).starts_with("line 7: x_ji"));
        assert!(refused(&tree().replace("<j>4", "<j>5")).contains("j = 4 and i = 0"));
        assert!(refused(&tree().replace("1537B", "1537A")).starts_with("line 2: key 1 and the nodes"));
        let refused = |text: &str| key(text).unwrap_err().to_string();
        assert!(refused(&tree()).contains("give it with --merkle-root"));
        assert!(refused(&public().replace("0374", "0574")).contains("a point of P-256"));
        assert!(refused(&public().replace("0374", "037")).contains("66 hexadecimal digits"));
        assert!(refused(&public().replace("<PKID>1", "<PKID>16")).contains("from 1 to 15"));
        assert!(refused(&public().replace("P-256/SHA-256", "P-521/SHA-512")).contains("PKType"));
    }
}
