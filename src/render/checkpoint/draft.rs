use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

/// A file that is written beside its place and then put there as a whole. Its name is always the same, so that those of
/// runs that were killed do not pile up; the file is locked, so that two writers do not mix.
pub(super) struct Draft {
    file: File,
    path: PathBuf,
    place: PathBuf,
}

impl Draft {
    /// Waits until nobody else writes there.
    pub(super) fn new(place: &Path) -> io::Result<Self> {
        let mut name = place.file_name().ok_or(io::ErrorKind::InvalidFilename)?.to_owned();
        name.push(".partial");
        let path = place.with_file_name(name);
        loop {
            let file = File::options().write(true).create(true).truncate(false).open(&path)?;
            file.lock()?;
            // Whoever held the lock has put the file in its place meanwhile.
            if !is_at(&file, &path)? {
                continue;
            }
            file.set_len(0)?;
            return Ok(Self { file, path, place: place.to_owned() });
        }
    }

    pub(super) fn file(&self) -> &File {
        &self.file
    }

    /// Puts the file in its place, where it stays even if the machine stops.
    pub(super) fn finish(self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.path, &self.place)?;
        #[cfg(unix)]
        File::open(folder(&self.place))?.sync_all()?;
        Ok(())
    }

    /// Leaves nothing behind.
    pub(super) fn discard(self) {
        // That a draft stays is told by the error for which it is discarded.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(unix)]
fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether an open file is the one with this path.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt as _;
    let open = file.metadata()?;
    match fs::metadata(path) {
        Ok(there) => Ok((open.dev(), open.ino()) == (there.dev(), there.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}
