//! The modules of the folders that the user names, by their import paths, and what of them a text needs.

use super::super::names::{listed, nearest, whole_word};
use super::super::{Modules, OtherFile, read_text};
use super::{Main, located};
use crate::{Diagnostic, Result};
use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, ShaderLanguage, get_preprocessor_data,
};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// How deep folders are searched.
const DEEPEST: usize = 32;

/// How many module files a search takes in: a folder such as `/` is a mistake.
const MOST: usize = 20_000;

/// The modules that can be imported, and those that are.
pub(super) struct Library {
    /// The files of each import path.
    found: BTreeMap<String, Vec<PathBuf>>,
    /// The folders that were searched.
    folders: Vec<PathBuf>,
    /// What has been read, by import path, in the order in which it was added.
    read: Vec<(String, OtherFile)>,
    /// Import paths that are nowhere, or in several places, and where they are first asked for: they matter only
    /// when code that is compiled uses them.
    missing: BTreeMap<String, Asked>,
}

/// Where an import path is asked for.
pub(super) struct Asked {
    name: String,
    text: String,
    place: Option<Range<usize>>,
}

impl Library {
    /// Searches the folders, or, without any, that of the first text.
    pub(super) fn read(mains: &[Main<'_>], modules: &Modules) -> Result<Self> {
        let own = mains.first().and_then(|main| main.path?.parent());
        let folders = match modules.folders.is_empty() {
            true => own.map(Path::to_owned).into_iter().collect(),
            false => modules.folders.clone(),
        };
        let mut found: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
        let mut files = Vec::new();
        for folder in &folders {
            // The current folder has an empty name.
            let folder = match folder.as_os_str().is_empty() {
                true => Path::new("."),
                false => folder.as_path(),
            };
            search(folder, DEEPEST, &mut files).map_err(|error| {
                Diagnostic::error(format!(
                    "cannot search the module folder `{}`: {error}",
                    folder.display()
                ))
                .with_note(
                    "name an existing folder with `-I`, or in `[modules] folders` of the scene",
                )
            })?;
        }
        let canonical = |path: &Path| path.canonicalize().ok();
        let taken: Vec<_> = mains.iter().filter_map(|m| canonical(m.path?)).collect();
        files.sort();
        files.dedup();
        for file in files {
            // What is no text declares nothing; when it is asked for, it is missing.
            let Ok(text) = std::fs::read_to_string(&file) else {
                continue;
            };
            let file = match file.strip_prefix(".") {
                Ok(bare) => bare.to_owned(),
                Err(_) => file,
            };
            if let Some(path) = import_path(&text)
                && !canonical(&file).is_some_and(|file| taken.contains(&file))
            {
                found.entry(path.to_owned()).or_default().push(file);
            }
        }
        Ok(Self {
            found,
            folders,
            read: Vec::new(),
            missing: BTreeMap::new(),
        })
    }

    /// Gives the composer what a text imports, and what that imports. Files begin behind `start`, which moves.
    pub(super) fn add_imports_of(
        &mut self,
        composer: &mut Composer,
        main: Main<'_>,
        start: &mut usize,
    ) -> Result<()> {
        let mut chain = Vec::new();
        let of = (main.name, main.text);
        self.add_all(composer, of, &mut chain, start)
    }

    fn add_all(
        &mut self,
        composer: &mut Composer,
        (name, text): (&str, &str),
        chain: &mut Vec<String>,
        start: &mut usize,
    ) -> Result<()> {
        let (_, imports, _) = get_preprocessor_data(text);
        for import in imports {
            let import = import.import;
            if composer.contains_module(&import) {
                continue;
            }
            let asked = || mention(text, &import);
            if let Some(at) = chain.iter().position(|module| *module == import) {
                let circle = chain[at..].iter().chain([&import]);
                let circle = listed(circle.map(String::as_str));
                let error = Diagnostic::error(format!("modules import each other: {circle}"))
                    .with_source(name, text);
                let error = match asked() {
                    Some(place) => error.with_label(place, "the circle closes here"),
                    None => error,
                };
                return Err(error.with_note("move what both need to a module of its own"));
            }
            let Some(file) = self.file(&import) else {
                let place = asked();
                let asked = Asked {
                    name: name.to_owned(),
                    text: text.to_owned(),
                    place,
                };
                self.missing.entry(import.clone()).or_insert(asked);
                // A module without anything in it, so that code that is left out may import it.
                add(composer, "", &import, &import)
                    .map_err(|error| super::refusal::of_module(&error, &import, ""))?;
                continue;
            };
            let shown = file.display().to_string();
            let module = read_text(&file, "module")?;
            chain.push(import.clone());
            self.add_all(composer, (&shown, &module), chain, start)?;
            chain.pop();
            add(composer, &module, &shown, &import)
                .map_err(|error| super::refusal::of_module(&error, &shown, &module))?;
            let length = module.len() + 1;
            self.read.push((
                import,
                OtherFile {
                    name: shown,
                    path: Some(file),
                    text: module,
                    start: *start,
                },
            ));
            *start += length;
        }
        Ok(())
    }

    /// The file of an import path, when there is one and no more; a path in quotes is that of a file in a folder.
    fn file(&self, import: &str) -> Option<PathBuf> {
        if let Some(file) = import.strip_prefix('"') {
            let file = file.trim_end_matches('"');
            let mut places = self.folders.iter().map(|folder| folder.join(file));
            return places.find(|place| place.is_file());
        }
        match self.found.get(import)?.as_slice() {
            [one] => Some(one.clone()),
            _ => None,
        }
    }

    /// What is said when code that is compiled needs a module that is nowhere, or in several places.
    pub(super) fn missing(&self, import: &str) -> Option<Box<Diagnostic>> {
        let asked = self.missing.get(import)?;
        let of = (asked.name.as_str(), asked.text.as_str());
        let error = |message: String| match asked.place.clone() {
            Some(place) => located(message, of, place, "imported here"),
            None => Diagnostic::error(message).with_source(of.0, of.1),
        };
        let shown = |paths: &[PathBuf]| {
            let paths: Vec<String> = paths
                .iter()
                .map(|path| match path.as_os_str().is_empty() {
                    true => ".".to_owned(),
                    false => path.display().to_string(),
                })
                .collect();
            listed(paths.iter().map(String::as_str))
        };
        if let Some(several) = self.found.get(import) {
            return Some(
                error(format!("several files define the module `{import}`"))
                    .with_reason(format!("they are {}", shown(several)))
                    .with_note("name folders with `-I` of which only one has it"),
            );
        }
        let near = nearest(import, self.found.keys().map(String::as_str), 3);
        let error = error(format!("there is no module `{import}`"));
        let error = match near.is_empty() {
            true => error,
            false => error.with_note(format!("there is {}", listed(near))),
        };
        Some(error.with_note(format!(
            "{} searched for it: name the folder that has it with `-I`",
            match self.folders.len() {
                0 => "no folder was".to_owned(),
                1 => format!("{} was", shown(&self.folders)),
                _ => format!("{} were", shown(&self.folders)),
            }
        )))
    }

    /// The file of a module that was added.
    pub(super) fn module(&self, import: &str) -> Option<&OtherFile> {
        let mut all = self.read.iter();
        all.find(|(path, _)| path == import).map(|(_, file)| file)
    }

    /// Every file that was read.
    pub(super) fn files(self) -> Vec<OtherFile> {
        self.read.into_iter().map(|(_, file)| file).collect()
    }
}

fn add(
    composer: &mut Composer,
    text: &str,
    file: &str,
    import: &str,
) -> std::result::Result<(), Box<naga_oil::compose::ComposerError>> {
    composer
        .add_composable_module(ComposableModuleDescriptor {
            source: text,
            file_path: file,
            language: ShaderLanguage::Wgsl,
            as_name: Some(import.to_owned()),
            ..Default::default()
        })
        .map(|_| ())
        .map_err(Box::new)
}

/// Every `.wgsl` file below a folder, but in hidden ones.
fn search(folder: &Path, deeper: usize, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let path = entry.path();
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        if entry.file_type()?.is_dir() {
            // What lies deeper or is not readable has no modules of the user's.
            if deeper > 0 && !hidden {
                let _ = search(&path, deeper - 1, files);
            }
        } else if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("wgsl"))
        {
            files.push(path);
            if files.len() > MOST {
                return Err(std::io::Error::other(format!(
                    "it has more than {MOST} `.wgsl` files"
                )));
            }
        }
    }
    Ok(())
}

/// The import path that a text gives itself.
fn import_path(text: &str) -> Option<&str> {
    text.lines().find_map(|line| {
        let rest = line.trim_start().strip_prefix('#')?.trim_start();
        let rest = rest.strip_prefix("define_import_path")?;
        rest.starts_with(char::is_whitespace)
            .then(|| rest.split_whitespace().next())
            .flatten()
    })
}

/// Where a text mentions an import path: in whole, or else its last part on a line of an import.
fn mention(text: &str, import: &str) -> Option<Range<usize>> {
    if let Some(at) = text.find(import) {
        return Some(at..at + import.len());
    }
    let last = import.rsplit("::").next()?;
    let mut from = 0;
    while let Some(at) = text[from..].find("import") {
        from += at;
        if let Some(found) = whole_word(text, from..text.len(), last) {
            return Some(found);
        }
        from += "import".len();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn import_paths_are_read_as_naga_oil_reads_them() {
        assert_eq!(import_path("\n # define_import_path a::b \n"), Some("a::b"));
        assert_eq!(import_path("// #define_import_path a\nfn f() {}"), None);
        assert_eq!(import_path("#define_import_paths a"), None);
    }

    #[test]
    fn a_path_is_found_where_it_is_imported_piece_by_piece() {
        let text = "fn fog() {}\n#import a::{lights, fog}\n";
        assert_eq!(mention(text, "a::fog"), Some(32..35));
        assert_eq!(mention("#import a::fog\n", "a::fog"), Some(8..14));
        assert_eq!(mention("fn f() {}", "a::fog"), None);
    }
}
