//! Faults planted in shaders that a running program reloads.

use std::path::{Path, PathBuf};

/// A copy of `shaders/` to plant faults in, removed when dropped.
pub struct ShaderCopy(pub PathBuf);

impl ShaderCopy {
    /// A fresh copy.
    pub fn new() -> Self {
        use std::sync::atomic::{AtomicU32, Ordering};
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("restir-shaders-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let copy = std::env::temp_dir().join(name);
        copy_folder(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), &copy);
        // File times are coarse on some systems; an edit must be newer than the copy.
        std::thread::sleep(std::time::Duration::from_millis(20));
        ShaderCopy(copy)
    }

    /// Puts `new` in the place of `old`, which must stand in `file` once.
    pub fn edit(&self, file: &str, old: &str, new: &str) {
        let path = self.0.join(file);
        let text = std::fs::read_to_string(&path).expect("the shader is there");
        assert_eq!(text.matches(old).count(), 1, "{file}: '{old}' must stand there once");
        std::fs::write(path, text.replace(old, new)).expect("the copy is writable");
    }
}

impl Drop for ShaderCopy {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("the temporary folder is writable");
    for entry in std::fs::read_dir(from).expect("shaders/ is readable").flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).expect("the temporary folder is writable");
        }
    }
}
