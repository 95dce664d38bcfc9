#include "worlds/loader/mesh_file.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <optional>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "worlds/loader/file_search.h"
#include "worlds/loader/mesh_text.h"
#include "worlds/loader/xml.h"

namespace tessera {
namespace {

// Mesh files name others, of materials and buffers: none but those in the folder of the mesh are read. The
// mesh itself may have another text than its file.
class FilesBeside final : public Assimp::DefaultIOSystem {
 public:
  FilesBeside(const std::filesystem::path& mesh, const std::optional<std::string>& text)
      : mesh_(mesh.string()), folder_(mesh.has_parent_path() ? mesh.parent_path() : "."), text_(text) {}

  bool Exists(const char* file) const override { return is_file_below(file, folder_); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (text_ && file == mesh_)
      return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(text_->data()), text_->size());
    return Exists(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  const std::string mesh_;
  const std::filesystem::path folder_;
  const std::optional<std::string>& text_;  // outlives this
};

// What assimp calls a node of COLLADA that has no name.
constexpr absl::string_view kNoName = "$ColladaAutoName$";

std::optional<std::uint32_t> colour_of(const aiMaterial& material) {
  aiColor3D diffuse;
  if (material.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse) != AI_SUCCESS) return std::nullopt;
  const auto byte = [](float share) {
    return share > 0 ? static_cast<std::uint32_t>(std::lround(255 * std::min(share, 1.0F))) : 0U;
  };
  return byte(diffuse.r) << 16 | byte(diffuse.g) << 8 | byte(diffuse.b);
}

// The meshes of a node and of all below it, in the file's order, in the axes of the root. `above`: the name
// of the nearest node above that has one.
void collect(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, const std::string& above,
             std::vector<SubMesh>& result) {
  const aiMatrix4x4 transform = parent * node.mTransformation;
  const std::string own = node.mName.C_Str();
  const std::string& name = own.empty() || absl::StartsWith(own, kNoName) ? above : own;
  for (unsigned n = 0; n < node.mNumMeshes; ++n) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[n]];
    SubMesh part;
    part.geometry = mesh.mName.C_Str();
    part.name = name.empty() ? part.geometry : name;
    part.colour = colour_of(*scene.mMaterials[mesh.mMaterialIndex]);
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D vertex = transform * mesh.mVertices[v];
      part.vertices.emplace_back(vertex.x, vertex.y, vertex.z);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices != 3) continue;  // points and lines have no interior
      part.indices.insert(part.indices.end(), mesh.mFaces[f].mIndices, mesh.mFaces[f].mIndices + 3);
    }
    if (!part.indices.empty()) result.push_back(std::move(part));
  }
  for (unsigned n = 0; n < node.mNumChildren; ++n)
    collect(scene, *node.mChildren[n], transform, name, result);
}

absl::Status refused(const std::filesystem::path& file, std::size_t number, const char* what,
                     std::size_t most) {
  return absl::InvalidArgumentError(
      absl::StrCat("mesh ", file.string(), ": ", number, " ", what, " must be at most ", most));
}

// Finds text in the lists of indices of a Collada file that is no number: assimp (5.2) reads on for ever
// where it should read one, and takes all memory.
class IndexLists final : public tinyxml2::XMLVisitor {
 public:
  bool Visit(const tinyxml2::XMLText& text) override {
    const xml::Element& element = *text.Parent()->ToElement();
    if (xml::is(element, "p") && !std::ranges::all_of(absl::string_view(text.Value()), is_of_numbers))
      status_ = xml::invalid(element, "indices must be integers");
    return status_.ok();
  }

  const absl::Status& status() const { return status_; }

 private:
  static bool is_of_numbers(char c) {
    const auto byte = static_cast<unsigned char>(c);
    return absl::ascii_isdigit(byte) || absl::ascii_isspace(byte) || c == '+' || c == '-';
  }

  absl::Status status_;
};

// The text of a COLLADA file in place of its own; none if that is fit to be read.
absl::StatusOr<std::optional<std::string>> text_of_collada(const std::filesystem::path& file) {
  auto read = xml::File::read(file);
  if (!read.ok()) return read.status();
  IndexLists lists;
  (*read)->root().Accept(&lists);
  if (!lists.status().ok()) return lists.status();
  return amended_collada((*read)->root());
}

absl::StatusOr<std::optional<std::string>> text_for_assimp(const std::filesystem::path& file) {
  const std::string format = absl::AsciiStrToLower(file.extension().string());
  if (format == ".dae") return text_of_collada(file);
  if (format != ".obj") return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  return amended_obj(text);
}

struct Lexicographic {
  bool operator()(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    return std::tie(a.x(), a.y(), a.z()) < std::tie(b.x(), b.y(), b.z());
  }
};

}  // namespace

absl::StatusOr<std::vector<SubMesh>> read_mesh_file(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) return absl::NotFoundError(absl::StrCat("mesh ", file.string(), ": there is no such file"));
  if (bytes > kWorldFileBytesMax) return refused(file, bytes, "bytes", kWorldFileBytesMax);
  const absl::StatusOr<std::optional<std::string>> text = text_for_assimp(file);
  if (!text.ok()) return absl::InvalidArgumentError(absl::StrCat("mesh ", text.status().message()));
  Assimp::Importer importer;
  importer.SetIOHandler(new FilesBeside(file, *text));  // which the importer owns
  // Like Gazebo, ignore the up axis of a Collada file: worlds rely on that.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);  // not ids
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TEXCOORDS | aiComponent_COLORS |
                                  aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_TEXTURES);
  const aiScene* scene = importer.ReadFile(
      file.string(), aiProcess_Triangulate | aiProcess_RemoveComponent | aiProcess_JoinIdenticalVertices);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat("mesh ", file.string(), ": ", importer.GetErrorString()));
  }
  std::vector<SubMesh> result;
  collect(*scene, *scene->mRootNode, aiMatrix4x4(), "", result);
  std::size_t vertices = 0;
  std::size_t indices = 0;
  for (const SubMesh& part : result) {
    vertices += part.vertices.size();
    indices += part.indices.size();
  }
  if (result.empty())
    return absl::InvalidArgumentError(absl::StrCat("mesh ", file.string(), ": it has no triangle"));
  if (vertices > kMeshVerticesMax) return refused(file, vertices, "vertices", kMeshVerticesMax);
  if (indices > kMeshIndicesMax) return refused(file, indices, "indices", kMeshIndicesMax);
  return result;
}

std::vector<Eigen::Vector3d> hull_points(const std::vector<Eigen::Vector3d>& points, std::size_t points_max) {
  const std::set<Eigen::Vector3d, Lexicographic> ordered(points.begin(), points.end());
  std::vector<Eigen::Vector3d> distinct(ordered.begin(), ordered.end());
  if (distinct.size() <= points_max) return distinct;
  std::set<Eigen::Vector3d, Lexicographic> kept;
  // Fibonacci's lattice on the sphere.
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  for (std::size_t n = 0; n < points_max; ++n) {
    const double z = 1 - (2 * static_cast<double>(n) + 1) / static_cast<double>(points_max);
    const double radius = std::sqrt(1 - z * z);
    const double angle = golden_angle * static_cast<double>(n);
    const portable::SinCos around = portable::sincos(angle);
    const Eigen::Vector3d direction(radius * around.cos, radius * around.sin, z);
    kept.insert(*std::max_element(distinct.begin(), distinct.end(), [&](const auto& a, const auto& b) {
      return direction.dot(a) < direction.dot(b);
    }));
  }
  return {kept.begin(), kept.end()};
}

}  // namespace tessera
