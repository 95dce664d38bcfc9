#include "coordinator/folder_store.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <sqlite3.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/state_parts.h"
#include "proto/snapshot_file.h"
#include "proto/whole_file.h"

namespace tessera {
namespace {

constexpr int kFormat = 1;
constexpr const char* kDatabase = "inputs.db";
constexpr const char* kStateSuffix = ".state";
constexpr const char* kUnfinishedSuffix = ".part";  // of WholeFile

// One SQLite database, used by one thread.
class Database {
 public:
  static absl::StatusOr<Database> open(const std::filesystem::path& file, const Disk& disk) {
    Database database;
    database.file_ = file;
    constexpr int kFlags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
    if (sqlite3_open_v2(file.c_str(), &database.handle_, kFlags, disk.sqlite_name()) != SQLITE_OK) {
      return database.error("cannot be opened");
    }
    // The lock is taken by the first write, and kept. A commit returns when it is on disk.
    for (const char* setting : {"PRAGMA locking_mode = EXCLUSIVE", "PRAGMA journal_mode = WAL",
                                "PRAGMA synchronous = FULL", "BEGIN IMMEDIATE", "COMMIT"}) {
      if (absl::Status status = database.run(setting); !status.ok()) return status;
    }
    return database;
  }
  Database(Database&& other) noexcept
      : file_(std::move(other.file_)), handle_(std::exchange(other.handle_, nullptr)) {}
  Database& operator=(Database&&) = delete;
  ~Database() { sqlite3_close_v2(handle_); }

  // `bind` sets the parameters, `row` takes each row.
  template <typename Bind, typename Row>
  absl::Status run(const char* sql, const Bind& bind, const Row& row) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(handle_, sql, -1, &statement, nullptr) != SQLITE_OK) return error(sql);
    const absl::Cleanup finalize = [statement] { sqlite3_finalize(statement); };
    bind(statement);
    for (;;) {
      const int code = sqlite3_step(statement);
      if (code == SQLITE_DONE) return absl::OkStatus();
      if (code != SQLITE_ROW) return error(sql);
      row(statement);
    }
  }
  template <typename Bind>
  absl::Status run(const char* sql, const Bind& bind) {
    return run(sql, bind, [](sqlite3_stmt*) {});
  }
  absl::Status run(const char* sql) {
    return run(sql, [](sqlite3_stmt*) {});
  }

  // All of `work` or nothing.
  template <typename Work>
  absl::Status at_once(const Work& work) {
    absl::Status status = run("BEGIN IMMEDIATE");
    if (!status.ok()) return status;
    status = work();
    if (status.ok()) status = run("COMMIT");
    if (!status.ok()) run("ROLLBACK").IgnoreError();
    return status;
  }

 private:
  Database() = default;

  absl::Status error(const char* what) const {
    const std::string text = absl::StrCat(file_.string(), ": ", sqlite3_errmsg(handle_), " (", what, ")");
    const int code = sqlite3_errcode(handle_);
    if (code == SQLITE_BUSY || code == SQLITE_LOCKED) {
      return absl::AlreadyExistsError(absl::StrCat(file_.string(), ": another coordinator uses this store"));
    }
    if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB) return absl::DataLossError(text);
    return absl::UnavailableError(text);
  }

  std::filesystem::path file_;
  sqlite3* handle_ = nullptr;
};

std::string text_at(sqlite3_stmt* row, int column) {
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(row, column));
  const int size = sqlite3_column_bytes(row, column);
  return bytes == nullptr ? std::string() : std::string(bytes, static_cast<std::size_t>(size));
}

std::uint64_t number_at(sqlite3_stmt* row, int column) {
  return static_cast<std::uint64_t>(sqlite3_column_int64(row, column));
}

void bind_number(sqlite3_stmt* statement, int place, std::uint64_t value) {
  sqlite3_bind_int64(statement, place, static_cast<sqlite3_int64>(value));
}

void bind_bytes(sqlite3_stmt* statement, int place, const std::string& bytes) {
  sqlite3_bind_blob64(statement, place, bytes.data(), bytes.size(), SQLITE_TRANSIENT);
}

absl::Status write_state(const std::filesystem::path& file, const StoredState& state, Disk& disk) {
  if (const auto* chunks = std::get_if<std::vector<v1::SnapshotChunk>>(&state)) {
    return write_snapshot(file, *chunks, disk);
  }
  absl::StatusOr<WholeFile> whole = WholeFile::create(file, disk);
  if (!whole.ok()) return whole.status();
  if (absl::Status status = whole->append(std::get<v1::World>(state).SerializeAsString()); !status.ok()) {
    return status;
  }
  return whole->finish();
}

absl::StatusOr<StoredState> read_state(const std::string& name, bool is_snapshot, const PathOfPart& path_of,
                                       Disk& disk) {
  if (is_snapshot) {
    absl::StatusOr<std::vector<v1::SnapshotChunk>> chunks = read_parts(name, path_of, disk);
    if (!chunks.ok()) return chunks.status();
    return *std::move(chunks);
  }
  const std::filesystem::path file = path_of(name);
  std::string bytes;
  absl::Status status = disk.read(file, [&](std::string_view piece) {
    bytes += piece;
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  v1::World world;
  if (!world.ParseFromString(bytes)) {
    return absl::DataLossError(absl::StrCat(file.string(), ": it is not a world as it was stored"));
  }
  return world;
}

// Table `state` has one row where there is a world: the file, which may have others before it, what it is,
// and after which input; `inputs` has those since.
class FolderStore final : public WorldStore {
 public:
  FolderStore(std::filesystem::path folder, Database database, Disk& disk)
      : folder_(std::move(folder)), database_(std::move(database)), disk_(disk) {}

  absl::Status read() {
    std::uint64_t format = kFormat;
    const auto nothing = [](sqlite3_stmt*) {};
    absl::Status status = database_.run("CREATE TABLE IF NOT EXISTS format (number INTEGER)");
    status.Update(database_.run("SELECT number FROM format", nothing,
                                [&](sqlite3_stmt* row) { format = number_at(row, 0); }));
    if (status.ok() && format != kFormat) {
      return absl::FailedPreconditionError(absl::StrCat(folder_.string(), ": a store of format ", format,
                                                        ", and this coordinator reads format ", kFormat));
    }
    status.Update(database_.run("DELETE FROM format"));
    status.Update(database_.run("INSERT INTO format VALUES (?)",
                                [](sqlite3_stmt* row) { bind_number(row, 1, kFormat); }));
    status.Update(
        database_.run("CREATE TABLE IF NOT EXISTS state (load INTEGER, file INTEGER, is_snapshot INTEGER, "
                      "position INTEGER)"));
    status.Update(database_.run(
        "CREATE TABLE IF NOT EXISTS inputs (position INTEGER PRIMARY KEY, input BLOB NOT NULL)"));
    bool is_snapshot = false;
    StoredWorld world;
    std::uint64_t since = 0;
    status.Update(
        database_.run("SELECT load, file, is_snapshot, position FROM state", nothing, [&](sqlite3_stmt* row) {
          world.load = number_at(row, 0);
          file_ = number_at(row, 1);
          is_snapshot = number_at(row, 2) != 0;
          since = number_at(row, 3);
        }));
    if (!status.ok() || world.load == 0) return status;
    load_ = world.load;
    position_ = since;
    bool all_readable = true;
    status = database_.run(
        "SELECT position, input FROM inputs WHERE position > ? ORDER BY position",
        [&](sqlite3_stmt* statement) { bind_number(statement, 1, since); },
        [&](sqlite3_stmt* row) {
          position_ = number_at(row, 0);
          all_readable = all_readable && world.inputs.emplace_back().ParseFromString(text_at(row, 1));
        });
    if (!status.ok()) return status;
    if (!all_readable) {
      return absl::DataLossError(absl::StrCat(folder_.string(), ": an input is not as it was stored"));
    }
    absl::StatusOr<StoredState> state = read_state(
        absl::StrCat(file_), is_snapshot, [this](const auto& name) { return path_of(name); }, disk_);
    if (!state.ok()) return state.status();
    world.state = *std::move(state);
    stored_ = std::move(world);
    files_ = parts_before(path_of(absl::StrCat(file_)), disk_);
    files_.push_back(absl::StrCat(file_));
    remove_other_states();
    return absl::OkStatus();
  }

  std::optional<StoredWorld> take_stored() override { return std::exchange(stored_, std::nullopt); }

  absl::Status begin(std::uint64_t load, const StoredState& state) override {
    wait_for_background();
    load_ = load;
    const std::uint64_t file = file_ + 1;
    const std::string name = absl::StrCat(file);
    if (absl::Status status = write_state(path_of(name), state, disk_); !status.ok()) return status;
    wants_whole_ = true;
    return refer_to(file, {name}, std::holds_alternative<std::vector<v1::SnapshotChunk>>(state), position_);
  }

  absl::Status end() override {
    wait_for_background();
    absl::Status status = database_.at_once([&] {
      absl::Status cleared = database_.run("DELETE FROM state");
      cleared.Update(database_.run("DELETE FROM inputs"));
      return cleared;
    });
    ++file_;
    files_.clear();
    remove_other_states();
    return status;
  }

  absl::Status append(const std::vector<v1::StoredInput>& inputs) override {
    std::uint64_t position = position_;
    absl::Status stored = database_.at_once([&] {
      for (const v1::StoredInput& input : inputs) {
        absl::Status status = database_.run("INSERT INTO inputs VALUES (?, ?)", [&](sqlite3_stmt* statement) {
          bind_number(statement, 1, ++position);
          bind_bytes(statement, 2, input.SerializeAsString());
        });
        if (!status.ok()) return status;
      }
      return absl::OkStatus();
    });
    if (stored.ok()) position_ = position;
    return stored;
  }
  std::uint64_t position() const override { return position_; }

  bool wants_whole() const override { return wants_whole_; }

  bool change(StateChange change, std::uint64_t position) override {
    if (background_) return false;
    StatePart part = parts_.add(absl::StrCat(file_ + 1), change);
    next_files_ = part.kept;
    next_files_.push_back(part.name);
    next_position_ = position;
    wants_whole_ = false;
    background_ = disk_.in_background([this, part = std::move(part), change = std::move(change)] {
      return write_part(
          part, change, [this](const auto& name) { return path_of(name); }, disk_);
    });
    return true;
  }

  absl::Status tend() override {
    if (!background_ || !background_->done()) return absl::OkStatus();
    const std::unique_ptr<Disk::Work> work = std::move(background_);
    absl::Status status = work->wait();
    if (status.ok())
      status = refer_to(file_ + 1, std::move(next_files_), /*is_snapshot=*/true, next_position_);
    wants_whole_ |= !status.ok();
    return status;
  }

  // A state that is being written is of no use any more.
  ~FolderStore() override { wait_for_background(); }

 private:
  std::filesystem::path path_of(const std::string& name) const {
    return folder_ / absl::StrCat(name, kStateSuffix);
  }

  void wait_for_background() {
    if (!background_) return;
    background_->wait().IgnoreError();
    background_.reset();
  }

  absl::Status refer_to(std::uint64_t file, std::vector<std::string> files, bool is_snapshot,
                        std::uint64_t position) {
    absl::Status status = database_.at_once([&] {
      absl::Status changed = database_.run("DELETE FROM state");
      changed.Update(database_.run("INSERT INTO state VALUES (?, ?, ?, ?)", [&](sqlite3_stmt* statement) {
        bind_number(statement, 1, load_);
        bind_number(statement, 2, file);
        bind_number(statement, 3, is_snapshot ? 1 : 0);
        bind_number(statement, 4, position);
      }));
      changed.Update(database_.run("DELETE FROM inputs WHERE position <= ?",
                                   [&](sqlite3_stmt* statement) { bind_number(statement, 1, position); }));
      return changed;
    });
    if (!status.ok()) return status;
    file_ = file;
    files_ = std::move(files);
    remove_other_states();
    return absl::OkStatus();
  }

  void remove_other_states() {
    for (const std::filesystem::path& file : disk_.files_in(folder_)) {
      const bool is_state = file.extension() == kStateSuffix;
      const bool is_needed = std::any_of(files_.begin(), files_.end(),
                                         [&](const std::string& name) { return file == path_of(name); });
      if (file.extension() == kUnfinishedSuffix || (is_state && !is_needed)) disk_.remove(file);
    }
  }

  std::filesystem::path folder_;
  Database database_;
  Disk& disk_;
  std::optional<StoredWorld> stored_;
  std::uint64_t load_ = 0;
  std::uint64_t file_ = 0;                  // the last one of the state that is stored
  std::vector<std::string> files_;          // all of it
  StateParts parts_;                        // with the one that is being written
  bool wants_whole_ = true;                 // since nobody knows what those of another process have
  std::uint64_t position_ = 0;              // of the last input
  std::unique_ptr<Disk::Work> background_;  // null: none is being written
  std::vector<std::string> next_files_;     // of the state that is being written, and
  std::uint64_t next_position_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<WorldStore>> open_folder_store(const std::filesystem::path& folder,
                                                              Disk& disk) {
  if (absl::Status status = disk.make_folder(folder); !status.ok()) return status;
  absl::StatusOr<Database> database = Database::open(folder / kDatabase, disk);
  if (!database.ok()) return database.status();
  auto store = std::make_unique<FolderStore>(folder, *std::move(database), disk);
  if (absl::Status status = store->read(); !status.ok()) return status;
  return store;
}

}  // namespace tessera
