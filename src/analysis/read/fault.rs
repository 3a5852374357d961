//! Faults of text files.

/// Fault of a foreign receiver's file, with its line.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Line of the file, counted from 1.
    pub line: u64,
    /// The fault in words, without file name and line.
    pub what: String,
}
