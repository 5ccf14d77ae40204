//! Reading inputs and writing outputs. Outputs of one run appear together or not at all.

use super::{INTERRUPTED, observe};
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Largest input file taken on, bytes.
const LARGEST_INPUT: u64 = 512 << 20;

/// Reads a whole input file.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    use std::io::Read;
    let name = path.display();
    // Looked at before it is opened: opening a pipe would wait for its other end.
    let meta = fs::metadata(path).with_context(|| format!("cannot read {name}"))?;
    if meta.is_dir() {
        bail!("{name} is a folder; give a file");
    }
    if !meta.is_file() {
        bail!("{name} is a device or a pipe; give a file");
    }
    let mut bytes = Vec::new();
    let file = fs::File::open(path).with_context(|| format!("cannot read {name}"))?;
    file.take(LARGEST_INPUT + 1)
        .read_to_end(&mut bytes)
        .with_context(|| format!("cannot read {name}"))?;
    if bytes.len() as u64 > LARGEST_INPUT {
        bail!("{name} has more than the {} MiB that are read; simplify it", LARGEST_INPUT >> 20);
    }
    Ok(bytes)
}

/// Reads a whole text file.
pub(super) fn read_text(path: &Path) -> Result<String> {
    let bytes = read(path)?;
    match String::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(e) => {
            let upto = e.utf8_error().valid_up_to();
            let line = e.as_bytes()[..upto].split(|b| *b == b'\n').count();
            bail!("{}:{line}: not UTF-8 text; save the file as UTF-8", path.display())
        }
    }
}

/// How a job file in `folder` names `file`: by a relative path where there is one, with `/` between.
pub(super) fn name_from(folder: &Path, file: &Path) -> Result<String> {
    let full = |p: &Path| {
        fs::canonicalize(p).with_context(|| format!("cannot find {} again", p.display()))
    };
    let (folder, file) = (full(folder)?, full(file)?);
    let common = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return Ok(file.display().to_string()); // another drive
    }
    let up = folder.components().skip(common).map(|_| "..".to_string());
    let down = file.components().skip(common).map(|c| c.as_os_str().to_string_lossy().into_owned());
    Ok(up.chain(down).collect::<Vec<_>>().join("/"))
}

/// The files of one run, gathered in a folder inside their destination and moved in at the end.
#[derive(Debug)]
pub(super) struct Outputs {
    folder: PathBuf,
    names: Vec<String>,
    staging: Staging,
}

/// What becomes of programs in the folder that an earlier run wrote and this one does not replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EarlierPrograms {
    /// They go: the folder never holds programs of two different jobs.
    TakeAway,
    /// They stay: this run has no programs of its own.
    Keep,
}

/// What this run has begun. A signal arrives on another thread and has nothing else to know it by.
static BEGUN: Mutex<Option<Staging>> = Mutex::new(None);

fn begun() -> MutexGuard<'static, Option<Staging>> {
    BEGUN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From here on Ctrl-C, SIGTERM and SIGHUP take away what was begun and end the process with exit code 130.
pub(super) fn watch_signals() {
    // Fails only when a handler is set already.
    let _ = ctrlc::set_handler(|| {
        // Waits while files are being moved in: that is never cut short.
        if let Some(staging) = begun().take() {
            staging.remove();
        }
        observe::complain("interrupted: nothing was written");
        std::process::exit(i32::from(INTERRUPTED));
    });
}

/// What has to go when the run ends early: by an error, or by a signal on another thread.
#[derive(Debug, Clone)]
struct Staging {
    path: PathBuf,
    /// The folders that this run made, innermost first.
    made: Vec<PathBuf>,
}

impl Staging {
    fn remove(&self) {
        fs::remove_dir_all(&self.path).ok();
        for folder in &self.made {
            fs::remove_dir(folder).ok(); // only when empty
        }
    }
}

impl Outputs {
    /// Prepares `folder` (made when missing); fails when it cannot be written.
    pub(super) fn prepare(folder: &Path) -> Result<Self> {
        let missing = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
        let made = folder.ancestors().take_while(missing).map(Path::to_path_buf).collect();
        let cure =
            || format!("cannot write into {}; choose another folder with --out", folder.display());
        let staging =
            Staging { path: folder.join(format!(".relievo-{}", std::process::id())), made };
        *begun() = Some(staging.clone());
        let outputs = Self { folder: folder.to_path_buf(), names: Vec::new(), staging };
        fs::create_dir_all(&outputs.staging.path).with_context(cure)?;
        Ok(outputs)
    }

    /// Adds one file.
    pub(super) fn add(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        use std::io::Write;
        let path = self.staging.path.join(name);
        let write = || -> std::io::Result<()> {
            let mut file = fs::File::create(&path)?;
            file.write_all(bytes)?;
            file.sync_all()
        };
        write().with_context(|| format!("cannot write {name} into {}", self.folder.display()))?;
        self.names.push(name.to_string());
        Ok(())
    }

    /// Moves all files in.
    pub(super) fn commit(self, earlier: EarlierPrograms) -> Result<()> {
        let held = begun(); // signals wait
        let done = self.move_in(&self.staging.path, earlier);
        drop(held);
        done
    }

    fn move_in(&self, staged: &Path, earlier: EarlierPrograms) -> Result<()> {
        for name in &self.names {
            let to = self.folder.join(name);
            if to.is_dir() {
                bail!("{} is a folder; move it away", to.display());
            }
        }
        let stale = match earlier {
            EarlierPrograms::TakeAway => self.earlier_programs()?,
            EarlierPrograms::Keep => Vec::new(),
        };
        let replaced = self.names.iter().map(|n| self.folder.join(n)).filter(|p| p.exists());
        let mut aside: Vec<(PathBuf, PathBuf)> = Vec::new();
        let mut moved: Vec<PathBuf> = Vec::new();
        let exchange = || -> Result<()> {
            for old in stale.into_iter().chain(replaced) {
                let keep = staged.join(format!("old-{}", aside.len()));
                fs::rename(&old, &keep)
                    .with_context(|| format!("cannot replace {}", old.display()))?;
                aside.push((old, keep));
            }
            for name in &self.names {
                let to = self.folder.join(name);
                fs::rename(staged.join(name), &to)
                    .with_context(|| format!("cannot write {}", to.display()))?;
                moved.push(to);
            }
            Ok(())
        };
        let done = exchange();
        if done.is_err() {
            // All or nothing: what was moved in goes, what was there comes back.
            for new in moved {
                fs::remove_file(new).ok();
            }
            for (old, keep) in aside {
                fs::rename(keep, old).ok();
            }
        }
        done
    }

    /// Programs in the destination that an earlier run wrote and this one does not replace.
    pub(super) fn earlier_programs(&self) -> Result<Vec<PathBuf>> {
        let mut stale = Vec::new();
        for entry in fs::read_dir(&self.folder)
            .with_context(|| format!("cannot list {}", self.folder.display()))?
        {
            let path = entry?.path();
            let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
            let ours = path.extension().is_some_and(|e| e == "nc")
                && name.starts_with(|c: char| c.is_ascii_digit())
                && starts_with_our_header(&path);
            if ours && !self.names.iter().any(|n| n == name) {
                stale.push(path);
            }
        }
        stale.sort();
        Ok(stale)
    }
}

fn starts_with_our_header(path: &Path) -> bool {
    use std::io::Read;
    let mut head = [0; 9];
    fs::File::open(path).and_then(|mut f| f.read_exact(&mut head)).is_ok() && &head == b"(relievo "
}

impl Drop for Outputs {
    fn drop(&mut self) {
        // After a commit the staging folder is empty and the destination is not.
        *begun() = None;
        self.staging.remove();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_that_are_not_committed_leave_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("out");
        let mut out = Outputs::prepare(&folder).unwrap();
        out.add("a.txt", b"a").unwrap();
        drop(out);
        assert!(!folder.exists());
    }

    #[test]
    fn programs_of_an_earlier_run_go_and_foreign_files_stay() {
        let dir = tempfile::tempdir().unwrap();
        let write = |n: &str, t: &str| fs::write(dir.path().join(n), t).unwrap();
        write("3-old.nc", "(relievo 0.1.0)\nG21\n");
        write("4-mine.nc", "(by hand)\nG21\n");
        write("notes.txt", "keep");
        let mut out = Outputs::prepare(dir.path()).unwrap();
        out.add("1-new.nc", b"(relievo 0.1.0)\n").unwrap();
        out.commit(EarlierPrograms::TakeAway).unwrap();
        let mut names: Vec<_> = fs::read_dir(dir.path())
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, ["1-new.nc", "4-mine.nc", "notes.txt"]);
    }

    #[test]
    fn a_run_without_programs_of_its_own_leaves_earlier_ones() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("1-rough.nc"), "(relievo 0.1.0)\nG21\n").unwrap();
        let mut out = Outputs::prepare(dir.path()).unwrap();
        out.add("surfaces.png", b"picture").unwrap();
        out.commit(EarlierPrograms::Keep).unwrap();
        assert!(dir.path().join("1-rough.nc").exists() && dir.path().join("surfaces.png").exists());
    }
}
