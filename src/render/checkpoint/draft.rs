use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

/// A temporary file beside its final place, which is renamed when it is complete. Its name is fixed, so that runs that
/// were killed do not leave many of them. The file is locked, so that two writers do not mix.
pub(super) struct Draft {
    file: File,
    path: PathBuf,
    place: PathBuf,
}

impl Draft {
    /// Opens the temporary file, and waits until no other process writes to it.
    pub(super) fn new(place: &Path) -> io::Result<Self> {
        let mut name = place.file_name().ok_or(io::ErrorKind::InvalidFilename)?.to_owned();
        name.push(".partial");
        let path = place.with_file_name(name);
        loop {
            let file = File::options().write(true).create(true).truncate(false).open(&path)?;
            file.lock()?;
            // The previous holder of the lock may have renamed the file meanwhile.
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

    /// Renames the file to its final place, and syncs it, so that it survives a crash of the machine.
    pub(super) fn finish(self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.path, &self.place)?;
        #[cfg(unix)]
        File::open(folder(&self.place))?.sync_all()?;
        Ok(())
    }

    /// Removes the temporary file.
    pub(super) fn discard(self) {
        // A failure to remove it is ignored: the caller reports the error that led here.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(unix)]
fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether an open file is still the one at this path.
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
