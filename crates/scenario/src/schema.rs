//! The scenario file as a JSON Schema, for editors.

use schemars::generate::SchemaSettings;

use super::file::whole::File;

/// The JSON Schema (draft 7, which editors' TOML tools read) of a scenario file, ending in a newline.
pub fn schema_json() -> String {
    let schema = SchemaSettings::draft07().into_generator().into_root_schema_for::<File>();
    format!("{:#}\n", schema.as_value())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use schemars::schema_for;
    use serde_json::Value;

    use super::super::tables::TABLES;
    use super::*;

    #[test]
    fn the_list_of_tables_is_complete() {
        let schema = schema_for!(File);
        let properties = schema.get("properties").and_then(Value::as_object).expect("the keys at the top");
        let tables = properties.iter().filter(|(_, key)| key.get("$ref").is_some());
        assert_eq!(tables.map(|(name, _)| name.as_str()).collect::<BTreeSet<_>>(), BTreeSet::from(TABLES));
    }
}
