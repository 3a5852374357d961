//! Content of a message of RTCM 3 or SBF, whose fields and observations are read in one pass.

use crate::observed::Event;
use crate::table::Table;

/// Content of a message.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Content {
    /// Name of the message, or its number where it has none.
    pub name: String,
    /// True if the fields of such messages are known.
    pub is_known: bool,
    /// Fields.
    pub table: Option<Table>,
    /// Content that can be joined with a truth.
    pub event: Option<Event>,
}
