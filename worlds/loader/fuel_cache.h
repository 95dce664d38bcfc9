// Models of Gazebo's collections in the network ("Fuel"), as far as Gazebo has brought them to this machine.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tessera {

// Whether a URI is http:// or https://. Nothing is ever fetched.
bool is_remote(const std::string& uri);

// https://SERVER/1.0/OWNER/models/NAME[/VERSION][/files/FILE]: a model, or one of its files.
struct FuelUri {
  std::string server;
  std::string owner;
  std::string name;
  std::string version;         // empty: the newest that is here
  std::filesystem::path file;  // below the folder of the model; empty: the model
};

// Nothing for a URI of another form, and for one whose parts would lead out of the cache.
std::optional<FuelUri> fuel_uri(const std::string& uri);

// The folders that gz-fuel-tools keeps models in: those of GZ_FUEL_CACHE_PATH and IGN_FUEL_CACHE_PATH, and
// .gz/fuel and .ignition/fuel in the user's home.
std::vector<std::filesystem::path> fuel_caches();

// Where the file or model of a URI is in these, if it is there: CACHE/SERVER/owner/models/name/VERSION/FILE.
// The server has had two names, and both are searched; owners and models are in small letters in newer
// caches.
std::vector<std::filesystem::path> places_in_fuel_caches(const FuelUri& uri);

}  // namespace tessera
