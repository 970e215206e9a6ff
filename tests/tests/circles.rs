//! No file of a crate needs one that needs it: whoever reads a file can read what it stands on first.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use syn::{Attribute, Item, UseTree, Visibility, visit::Visit};

/// Names that lead to something, from the crate's root.
type Names = Vec<String>;

/// A file, as far as it matters who needs whom.
#[derive(Default)]
struct File {
    /// Names that it brings into scope, and what they stand for.
    uses: BTreeMap<String, Names>,
    /// Paths in its code, as they stand there.
    paths: BTreeSet<Names>,
}

/// The files of a crate by their modules.
type Crate = BTreeMap<Names, File>;

/// Collects the paths of a file, its tests aside.
struct Paths<'a>(&'a mut File);

impl<'a> Visit<'a> for Paths<'_> {
    fn visit_item(&mut self, item: &'a Item) {
        let is_test = |attribute: &Attribute| {
            attribute.path().is_ident("cfg")
                && attribute.parse_args::<syn::Path>().is_ok_and(|it| it.is_ident("test"))
        };
        let attributes: &[Attribute] = match item {
            Item::Mod(it) => &it.attrs,
            Item::Fn(it) => &it.attrs,
            Item::Use(it) => &it.attrs,
            _ => &[],
        };
        if !attributes.iter().any(is_test) {
            syn::visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        each_use(&item.tree, &mut Names::new(), &mut |name, names| drop(self.0.uses.insert(name, names)));
    }

    /// Left out: a visibility needs nothing of the modules that it names.
    fn visit_visibility(&mut self, _: &'a Visibility) {}

    fn visit_path(&mut self, path: &'a syn::Path) {
        self.0.paths.insert(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        syn::visit::visit_path(self, path);
    }

    /// Words of a macro that look like paths are taken for such.
    fn visit_macro(&mut self, of_macro: &'a syn::Macro) {
        let words = of_macro.tokens.to_string().replace(" :: ", "::");
        let paths = words.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
        let names =
            |path: &str| path.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect();
        self.0.paths.extend(paths.filter(|path| path.contains("::")).map(names));
        syn::visit::visit_macro(self, of_macro);
    }
}

/// Gives `take` each name that a `use` brings into scope, with what it stands for.
fn each_use(tree: &UseTree, above: &mut Names, take: &mut impl FnMut(String, Names)) {
    match tree {
        UseTree::Path(path) => {
            above.push(path.ident.to_string());
            each_use(&path.tree, above, take);
            above.pop();
        }
        UseTree::Group(group) => group.items.iter().for_each(|tree| each_use(tree, above, take)),
        UseTree::Name(name) if name.ident == "self" => take(above.last().unwrap().clone(), above.clone()),
        UseTree::Name(name) => take(name.ident.to_string(), [&above[..], &[name.ident.to_string()]].concat()),
        UseTree::Rename(name) => {
            take(name.rename.to_string(), [&above[..], &[name.ident.to_string()]].concat())
        }
        UseTree::Glob(_) => take(format!("* of {}", above.join("::")), above.clone()),
    }
}

/// The files below a crate's `src`.
fn crate_in(src: &Path) -> Crate {
    let mut files = Crate::new();
    let mut folders = vec![src.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            // Tests that have a file of their own.
            if path
                .components()
                .any(|name| ["tests", "tests.rs"].iter().any(|tests| name.as_os_str() == *tests))
            {
                continue;
            }
            let place = path.with_extension("");
            let names: Names = place
                .strip_prefix(src)
                .unwrap()
                .iter()
                .map(|name| name.to_str().unwrap().to_owned())
                .collect();
            let names = if ["lib", "main"].contains(&&*names.join("/")) { Names::new() } else { names };
            let syntax = syn::parse_file(&fs::read_to_string(&path).unwrap()).unwrap();
            Paths(files.entry(names).or_default()).visit_file(&syntax);
        }
    }
    files
}

/// The module that has what `path` means where `module` names it; `None` if it is of another crate.
fn owner(files: &Crate, module: &Names, path: &[String], hops: usize) -> Option<Names> {
    let (first, rest) = path.split_first()?;
    let parent = || module.split_last().map(|(_, above)| above.to_vec());
    let found = match first.as_str() {
        "crate" => descend(files, Names::new(), rest),
        "self" => descend(files, module.clone(), rest),
        "super" => match rest.first().is_some_and(|next| next == "super") {
            true => return owner(files, &parent()?, rest, hops),
            false => descend(files, parent()?, rest),
        },
        name => {
            let child = [&module[..], &[name.to_owned()]].concat();
            match files.get(module)?.uses.get(name) {
                _ if files.contains_key(&child) => descend(files, child, rest),
                Some(names) if names[..] != *path && hops > 0 => {
                    return owner(files, module, &[&names[..], rest].concat(), hops - 1);
                }
                _ => return None,
            }
        }
    };
    // What a module has from elsewhere is of there.
    let (module, rest) = found;
    match rest.first().and_then(|name| files[&module].uses.get(name)) {
        Some(names) if hops > 0 => {
            let further = [&names[..], &rest[1..]].concat();
            Some(owner(files, &module, &further, hops - 1).unwrap_or(module))
        }
        _ => Some(module),
    }
}

/// The deepest module along a path, and what is left of it.
fn descend(files: &Crate, mut module: Names, mut rest: &[String]) -> (Names, Vec<String>) {
    while let [next, after @ ..] = rest {
        let child = [&module[..], std::slice::from_ref(next)].concat();
        if !files.contains_key(&child) {
            break;
        }
        (module, rest) = (child, after);
    }
    (module, rest.to_vec())
}

/// Modules of one crate, and those that each needs.
fn needs(files: &Crate) -> BTreeMap<Names, BTreeSet<Names>> {
    let of = |(module, file): (&Names, &File)| {
        let owners = file.uses.values().chain(&file.paths).filter_map(|path| owner(files, module, path, 8));
        (module.clone(), owners.filter(|owner| owner != module).collect())
    };
    files.iter().map(of).collect()
}

/// A circle among these, if there is one: each needs the next, the last the first.
fn circle<N: Ord + Clone>(needs: &BTreeMap<N, BTreeSet<N>>) -> Option<Vec<N>> {
    let mut left = needs.clone();
    loop {
        let keys: BTreeSet<N> = left.keys().cloned().collect();
        let before = left.len();
        left.retain(|_, needed| needed.iter().any(|it| keys.contains(it)));
        if left.is_empty() {
            return None;
        }
        if left.len() == before {
            let mut way = vec![keys.first()?.clone()];
            loop {
                let next = left[way.last()?].iter().find(|it| keys.contains(it))?.clone();
                if let Some(at) = way.iter().position(|it| *it == next) {
                    return Some(way.split_off(at));
                }
                way.push(next);
            }
        }
    }
}

/// The same among folders: a file and the folder of its name are one, at each depth.
fn folders(needs: &BTreeMap<Names, BTreeSet<Names>>, above: &[String]) -> BTreeMap<Names, BTreeSet<Names>> {
    let below = |names: &Names| {
        let is_below = names.len() > above.len() && names.starts_with(above);
        is_below.then(|| names[..=above.len()].to_vec())
    };
    let mut among = BTreeMap::<Names, BTreeSet<Names>>::new();
    for (from, to) in needs.iter().flat_map(|(from, needed)| needed.iter().map(move |to| (from, to))) {
        if let (Some(from), Some(to)) = (below(from), below(to))
            && from != to
        {
            among.entry(from).or_default().insert(to);
        }
    }
    among
}

fn sources() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let manifest: toml::Table = fs::read_to_string(root.join("Cargo.toml")).unwrap().parse().unwrap();
    let members = manifest["workspace"]["members"].as_array().unwrap();
    let mut sources = Vec::new();
    for member in members.iter().map(|member| member.as_str().unwrap()) {
        match member.strip_suffix("/*") {
            Some(folder) => {
                sources.extend(fs::read_dir(root.join(folder)).unwrap().map(|entry| entry.unwrap().path()))
            }
            None => sources.push(root.join(member)),
        }
    }
    sources.iter().map(|member| member.join("src")).filter(|src| src.is_dir()).collect()
}

#[test]
fn no_files_and_no_folders_of_a_crate_need_each_other() {
    let sources = sources();
    assert!(sources.len() > 15, "{sources:?} are not all");
    let mut circles = Vec::new();
    for src in sources {
        let needs = needs(&crate_in(&src));
        let above: BTreeSet<Names> =
            needs.keys().map(|names| names[..names.len().saturating_sub(1)].to_vec()).collect();
        let all = [needs.clone()].into_iter().chain(above.iter().map(|above| folders(&needs, above)));
        circles.extend(all.filter_map(|needs| circle(&needs)).map(|circle| {
            let names: Vec<_> = circle.iter().map(|names| format!("{}::", names.join("::"))).collect();
            format!("{}: {}", src.display(), names.join(" -> "))
        }));
    }
    assert!(circles.is_empty(), "circles:\n{}", circles.join("\n"));
}

#[test]
fn a_circle_is_found_through_what_is_handed_on() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("lib.rs", "mod a; mod b; mod c; pub use b::B;");
    write("a.rs", "pub fn f() -> crate::B { loop {} } #[cfg(test)] mod tests { use crate::c::C; }");
    write("b.rs", "use super::c; pub struct B(c::C);");
    write("c.rs", "pub struct C;");
    let found = |folder: &Path| circle(&needs(&crate_in(folder)));
    assert_eq!(found(folder.path()), None);
    write("c.rs", "pub struct C; fn g() { crate::a::f() }");
    assert_eq!(found(folder.path()).map(|circle| circle.concat().concat()), Some("bca".into()));
}
