//! stub
pub struct Catalogue;
