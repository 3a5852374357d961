//! What is wrong with a text file, and where.

/// What is wrong with a file of a foreign receiver, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Line of the file, counted from 1.
    pub line: u64,
    /// The fault in words, without file name and line.
    pub what: String,
}
