//! Puts the page into the program: `studio/` of the repository, built by npm, as a table of files.
//!
//! Without Node or `studio/` (as in a published package) the build succeeds, and the server has one plain page that
//! explains how to get the real one. `SIDESTEP_PAGE=require` fails instead, `SIDESTEP_PAGE=skip` does not even try,
//! and `SIDESTEP_PAGE_DIST=DIR` takes a page that was built before.

use std::collections::hash_map::DefaultHasher;
use std::fmt::Write;
use std::fs::{self, File};
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;
use std::{env, io};

/// Parts of `studio/` that do not go into the page.
const EXCLUDED: [&str; 6] =
    ["node_modules", "dist", "tests", "screenshots", "README.md", ".build-lock"];

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let studio =
        Path::new(&env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("../../studio");
    println!("cargo::rerun-if-changed=build.rs");
    for name in ["SIDESTEP_PAGE", "SIDESTEP_PAGE_DIST"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    let mode = env::var("SIDESTEP_PAGE").unwrap_or_default();
    let page = match (env::var_os("SIDESTEP_PAGE_DIST"), mode.as_str()) {
        (Some(folder), _) => {
            println!("cargo::rerun-if-changed={}", Path::new(&folder).display());
            Ok(PathBuf::from(folder))
        }
        (None, "skip") => Err("it was built with SIDESTEP_PAGE=skip".to_string()),
        (None, _) => build_page(&studio, &out.join("page")),
    };
    let files = page.and_then(|page| files_of(&page));
    let files = files.unwrap_or_else(|cause| {
        assert!(mode != "require", "SIDESTEP_PAGE=require, but there is no page: {cause}");
        vec![("index.html".into(), write_plain(&out, &cause))]
    });
    fs::write(out.join("assets.rs"), table(&files)).expect("the table is written");
}

/// Builds the page into a folder.
fn build_page(studio: &Path, page: &Path) -> Result<PathBuf, String> {
    const NO_SOURCES: &str = "the sources of the page are not here";
    if !studio.join("package.json").is_file() {
        return Err(NO_SOURCES.into());
    }
    let entries = fs::read_dir(studio).map_err(|_| NO_SOURCES)?;
    let mut names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
    names.sort();
    for name in names.iter().filter(|name| EXCLUDED.iter().all(|aside| name != aside)) {
        println!("cargo::rerun-if-changed={}", studio.join(name).display());
    }
    if npm().arg("--version").output().is_err() {
        return Err("npm was not installed when it was built".into());
    }
    // Several cargo processes may build at once, such as an editor's.
    let lock = File::create(studio.join(".build-lock")).map_err(|e| e.to_string())?;
    lock.lock().map_err(|e| e.to_string())?;
    let made = install(studio).and_then(|()| {
        let folder = page.to_str().ok_or("the folder of the build has an odd name")?;
        run(studio, &["run", "build", "--", "--outDir", folder, "--emptyOutDir"])
    });
    made.inspect_err(|cause| {
        println!("cargo::warning=the page of the studio is not built: {cause}")
    })?;
    Ok(page.to_path_buf())
}

/// Installs the tools that build the page, unless they are installed already.
fn install(studio: &Path) -> Result<(), String> {
    // npm writes a copy of the lock file at the end of an installation.
    let installed = modified(&studio.join("node_modules/.package-lock.json"));
    let wanted = modified(&studio.join("package-lock.json"));
    if let (Ok(installed), Ok(wanted)) = (installed, wanted)
        && installed >= wanted
    {
        return Ok(());
    }
    run(studio, &["ci", "--omit=dev", "--no-audit", "--no-fund", "--prefer-offline"])
}

fn modified(path: &Path) -> io::Result<SystemTime> {
    path.metadata()?.modified()
}

fn npm() -> Command {
    Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" })
}

fn run(studio: &Path, args: &[&str]) -> Result<(), String> {
    let ended = npm().args(args).current_dir(studio).env_remove("NODE_ENV").output();
    let ended = ended.map_err(|e| format!("npm cannot be started: {e}"))?;
    if ended.status.success() {
        return Ok(());
    }
    // A warning of cargo is one line.
    let said = String::from_utf8_lossy(&ended.stderr);
    let lines = said.lines().map(str::trim).filter(|line| !line.is_empty());
    let words: Vec<&str> = lines.collect();
    let last = words[words.len().saturating_sub(6)..].join(" | ");
    Err(format!("`npm {}` failed: {last}", args[..args.len().min(2)].join(" ")))
}

/// Returns the files below a folder by their paths in it, in their order.
fn files_of(folder: &Path) -> Result<Vec<(String, PathBuf)>, String> {
    let mut open = vec![folder.to_path_buf()];
    let mut files = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).map_err(|e| unreadable(&folder, &e))? {
            let path = entry.map_err(|e| unreadable(&folder, &e))?.path();
            if path.is_dir() { open.push(path) } else { files.push(path) }
        }
    }
    let mut named = Vec::new();
    for path in files {
        let inside = path.strip_prefix(folder).map_err(|e| e.to_string())?;
        let parts: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
        let real = fs::canonicalize(&path).map_err(|e| unreadable(&path, &e))?;
        named.push((parts.join("/"), real));
    }
    // The order of a folder's entries differs between machines, and the table shall not.
    named.sort();
    if !named.iter().any(|(name, _)| name == "index.html") {
        return Err(format!("there is no index.html in {}", folder.display()));
    }
    Ok(named)
}

fn unreadable(path: &Path, error: &io::Error) -> String {
    format!("{} cannot be read: {error}", path.display())
}

/// Returns the table of files as source.
fn table(files: &[(String, PathBuf)]) -> String {
    let mut text = String::from("static ASSETS: &[PageAsset] = &[\n");
    for (name, path) in files {
        let content = fs::read(path).expect("the page is read");
        let mut hasher = DefaultHasher::new();
        content.hash(&mut hasher);
        let media = media(name);
        let tag = format!("\"{:016x}\"", hasher.finish());
        let path = path.display().to_string();
        writeln!(
            text,
            "    PageAsset {{ path: {name:?}, media: {media:?}, tag: {tag:?}, bytes: include_bytes!({path:?}) }},"
        )
        .expect("text");
    }
    text + "];\n"
}

fn media(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "ico" => "image/x-icon",
        "json" | "map" | "webmanifest" => "application/json",
        "woff2" => "font/woff2",
        "txt" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

/// Writes the page served in place of the real one.
fn write_plain(out: &Path, cause: &str) -> PathBuf {
    let cause = cause.replace('&', "&amp;").replace('<', "&lt;");
    let text = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>Sidestep studio</title>\n\
         <h1>The studio runs, but this program has no page</h1>\n<p>The reason: {cause}.</p>\n\
         <p>To get it, install Node 20.19 or later, and build Sidestep from its repository:</p>\n\
         <pre>cargo build --release</pre>\n\
         <p>With a page that was built elsewhere: <code>SIDESTEP_PAGE_DIST=DIR cargo build --release</code>.</p>\n\
         </html>\n"
    );
    let path = out.join("index.html");
    fs::write(&path, text).expect("the plain page is written");
    path
}
