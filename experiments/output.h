// Where experiments write what they measured.
#pragma once

#include <filesystem>
#include <string>

namespace tessera::experiments {

// FILE_name.csv beside FILE.csv, for tables besides the main one.
std::filesystem::path beside(const std::filesystem::path& file, const std::string& name);

}  // namespace tessera::experiments
