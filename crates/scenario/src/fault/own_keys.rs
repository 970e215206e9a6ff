//! The half of a `[[fault]]` table that its kind reads.

use serde::de::DeserializeOwned;

use crate::document::Document;
use crate::error::ScenarioError;

/// The keys of a table that only its kind has.
pub(super) struct OwnKeys<'d, 'a> {
    pub(super) document: &'d Document<'a>,
    pub(super) path: &'d str,
    pub(super) is_common: &'d dyn Fn(&str) -> bool,
}

impl OwnKeys<'_, '_> {
    pub(super) fn read<T: DeserializeOwned>(self) -> Result<T, ScenarioError> {
        self.document.read(self.path, |key| key != "kind" && !(self.is_common)(key))
    }
}
