// Output files of experiments.
#pragma once

#include <filesystem>
#include <string>

namespace tessera::experiments {

// FILE_name.csv next to FILE.csv, for tables other than the main one.
std::filesystem::path beside(const std::filesystem::path& file, const std::string& name);

}  // namespace tessera::experiments
