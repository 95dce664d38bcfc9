// The functions that SQLite calls are documented at https://www.sqlite.org/c3ref/io_methods.html and
// vfs.html.
#include "simulator/disk_vfs.h"

#include <sqlite3.h>

#include <cstring>
#include <new>
#include <utility>

#include "lpss/base/invariant.h"
#include "simulator/simulated_disk.h"

namespace tessera {
namespace {

// An open file, made in memory of SQLite's.
struct OpenFile {
  sqlite3_file base{};
  SimulatedDisk* disk = nullptr;
  SimulatedDisk::InodePtr inode;
  std::string remove_at_close;  // a name, if not empty
  bool names_are_unsynced = false;
};

OpenFile& opened(sqlite3_file* file) { return *reinterpret_cast<OpenFile*>(file); }

int code_of(SimulatedDisk::Outcome outcome, int failure) {
  if (outcome == SimulatedDisk::Outcome::kDone) return SQLITE_OK;
  return outcome == SimulatedDisk::Outcome::kFull ? SQLITE_FULL : failure;
}

int close_file(sqlite3_file* file) {
  OpenFile& open = opened(file);
  if (!open.remove_at_close.empty()) open.disk->remove_name(open.remove_at_close);
  open.~OpenFile();
  return SQLITE_OK;
}

int read_file(sqlite3_file* file, void* to, int size, sqlite3_int64 offset) {
  OpenFile& open = opened(file);
  std::string bytes;
  const auto outcome =
      open.disk->read(*open.inode, static_cast<std::size_t>(offset), static_cast<std::size_t>(size), bytes);
  if (outcome != SimulatedDisk::Outcome::kDone) return SQLITE_IOERR_READ;
  std::memset(to, 0, static_cast<std::size_t>(size));
  std::memcpy(to, bytes.data(), bytes.size());
  return bytes.size() == static_cast<std::size_t>(size) ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
}

int write_file(sqlite3_file* file, const void* from, int size, sqlite3_int64 offset) {
  OpenFile& open = opened(file);
  const std::string_view bytes(static_cast<const char*>(from), static_cast<std::size_t>(size));
  return code_of(open.disk->write(*open.inode, static_cast<std::size_t>(offset), bytes), SQLITE_IOERR_WRITE);
}

int truncate_file(sqlite3_file* file, sqlite3_int64 size) {
  OpenFile& open = opened(file);
  return code_of(open.disk->truncate(*open.inode, static_cast<std::size_t>(size)), SQLITE_IOERR_TRUNCATE);
}

// As SQLite's own interface does, the first sync of a new journal is one of its folder, too.
int sync_file(sqlite3_file* file, int) {
  OpenFile& open = opened(file);
  int code = code_of(open.disk->sync(*open.inode), SQLITE_IOERR_FSYNC);
  if (code == SQLITE_OK && open.names_are_unsynced) {
    code = code_of(open.disk->sync_names(), SQLITE_IOERR_DIR_FSYNC);
    open.names_are_unsynced = code != SQLITE_OK;
  }
  return code;
}

int file_size(sqlite3_file* file, sqlite3_int64* size) {
  *size = static_cast<sqlite3_int64>(opened(file).inode->bytes().size());
  return SQLITE_OK;
}

// One process uses a simulated disk.
int lock_file(sqlite3_file*, int) { return SQLITE_OK; }
int is_reserved(sqlite3_file*, int* result) {
  *result = 0;
  return SQLITE_OK;
}
int control_file(sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; }
int sector_size(sqlite3_file*) { return 512; }
int characteristics(sqlite3_file*) { return SQLITE_IOCAP_POWERSAFE_OVERWRITE; }

constexpr sqlite3_io_methods kFileMethods = {
    1,         close_file, read_file,   write_file,   truncate_file, sync_file,       file_size,
    lock_file, lock_file,  is_reserved, control_file, sector_size,   characteristics, nullptr,
    nullptr,   nullptr,    nullptr,     nullptr,      nullptr};

SimulatedDisk& disk_of(sqlite3_vfs* vfs) { return *static_cast<SimulatedDisk*>(vfs->pAppData); }

int open_file(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* flags_out) {
  SimulatedDisk& disk = disk_of(vfs);
  OpenFile& open = *new (file) OpenFile{};  // base.pMethods is null: nothing to close if this fails
  open.disk = &disk;
  if (name == nullptr) {
    open.inode = std::make_shared<SimulatedDisk::Inode>();  // a file of SQLite's own, for a moment
  } else {
    open.inode = disk.find(name);
    if (!open.inode && (flags & SQLITE_OPEN_CREATE) != 0) {
      open.inode = disk.make(name);
      open.names_are_unsynced = (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL)) != 0;
    }
    if ((flags & SQLITE_OPEN_DELETEONCLOSE) != 0) open.remove_at_close = name;
  }
  if (!open.inode) {
    open.~OpenFile();
    file->pMethods = nullptr;
    return SQLITE_CANTOPEN;
  }
  open.base.pMethods = &kFileMethods;
  if (flags_out != nullptr) *flags_out = flags;
  return SQLITE_OK;
}

int delete_file(sqlite3_vfs* vfs, const char* name, int sync_folder) {
  SimulatedDisk& disk = disk_of(vfs);
  if (!disk.find(name)) return SQLITE_IOERR_DELETE_NOENT;
  int code = code_of(disk.remove_name(name), SQLITE_IOERR_DELETE);
  if (code == SQLITE_OK && sync_folder != 0) code = code_of(disk.sync_names(), SQLITE_IOERR_DIR_FSYNC);
  return code;
}

int access_file(sqlite3_vfs* vfs, const char* name, int, int* result) {
  *result = disk_of(vfs).find(name) ? 1 : 0;
  return SQLITE_OK;
}

int full_name(sqlite3_vfs*, const char* name, int size, char* out) {
  if (std::strlen(name) >= static_cast<std::size_t>(size)) return SQLITE_CANTOPEN;
  std::strcpy(out, name);
  return SQLITE_OK;
}

int randomness(sqlite3_vfs*, int size, char* out) {
  std::memset(out, 0x5a, static_cast<std::size_t>(size));
  return size;
}
int sleep_for(sqlite3_vfs*, int microseconds) { return microseconds; }
int current_time(sqlite3_vfs*, double* days) {
  *days = 2460000;
  return SQLITE_OK;
}
int last_error(sqlite3_vfs*, int, char*) { return 0; }

constexpr int kFileNameBytesMax = 1024;

}  // namespace

struct DiskVfs::Registered {
  std::string name;
  sqlite3_vfs vfs{};
};

DiskVfs::DiskVfs(SimulatedDisk& disk, const std::string& name) : registered_(std::make_unique<Registered>()) {
  registered_->name = name;
  sqlite3_vfs& vfs = registered_->vfs;
  vfs.iVersion = 1;
  vfs.szOsFile = sizeof(OpenFile);
  vfs.mxPathname = kFileNameBytesMax;
  vfs.zName = registered_->name.c_str();
  vfs.pAppData = &disk;
  vfs.xOpen = open_file;
  vfs.xDelete = delete_file;
  vfs.xAccess = access_file;
  vfs.xFullPathname = full_name;
  vfs.xRandomness = randomness;
  vfs.xSleep = sleep_for;
  vfs.xCurrentTime = current_time;
  vfs.xGetLastError = last_error;
  invariant(sqlite3_vfs_register(&vfs, /*makeDflt=*/0) == SQLITE_OK, "SQLite knows simulated disks");
}

DiskVfs::~DiskVfs() { sqlite3_vfs_unregister(&registered_->vfs); }

}  // namespace tessera
