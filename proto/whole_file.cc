#include "proto/whole_file.h"

#include <utility>

namespace tessera {

absl::StatusOr<WholeFile> WholeFile::create(std::filesystem::path file, Disk& disk) {
  std::filesystem::path beside = file;
  beside += ".part";
  absl::StatusOr<std::unique_ptr<Disk::File>> out = disk.create(beside);
  if (!out.ok()) return out.status();
  return WholeFile(std::move(file), std::move(beside), disk, *std::move(out));
}

WholeFile::WholeFile(std::filesystem::path file, std::filesystem::path beside, Disk& disk,
                     std::unique_ptr<Disk::File> out)
    : file_(std::move(file)), beside_(std::move(beside)), disk_(&disk), out_(std::move(out)) {}

WholeFile::~WholeFile() {
  if (out_ == nullptr) return;
  out_.reset();
  disk_->remove(beside_);
}

absl::Status WholeFile::finish() { return finish_and_keep().status(); }

absl::StatusOr<std::unique_ptr<Disk::File>> WholeFile::finish_and_keep() {
  if (absl::Status status = out_->sync(); !status.ok()) return status;
  if (absl::Status status = disk_->rename(beside_, file_); !status.ok()) return status;
  return std::move(out_);
}

}  // namespace tessera
