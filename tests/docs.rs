//! Documents that are made from code are up to date.

/// `Q3RAYS_UPDATE_DOCS=1` rewrites the file.
#[test]
fn the_table_of_variables_is_what_the_code_says() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/cvars.md");
    let wanted = q3rays::console::table::markdown() + &q3rays::console::commands::markdown();
    if std::env::var_os("Q3RAYS_UPDATE_DOCS").is_some() {
        std::fs::write(path, &wanted).expect("docs/cvars.md can be written");
    }
    let found = std::fs::read_to_string(path).expect("docs/cvars.md is there");
    assert_eq!(found, wanted, "run the tests once with Q3RAYS_UPDATE_DOCS=1");
}
