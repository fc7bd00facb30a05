#pragma once

#include <set>
#include <string>
#include <utility>

#include <assimp/IOSystem.hpp>

namespace vrpipe {

/// What every UserError about a mesh begins with.
constexpr char kCannotReadMesh[] = "cannot read mesh";

/// Reads a regular file whole, of at most a gigabyte.
/// @throws UserError that begins "cannot read mesh"
std::string read_mesh_file(const std::string& path);

/// What assimp may open: the mesh, whose bytes are here already, and the files it names (materials, buffers), which must be
/// regular ones, so that no pipe blocks.
class AssetFiles : public Assimp::IOSystem {
 public:
  AssetFiles(std::string path, std::string bytes, bool obj)
      : path_(std::move(path)), bytes_(std::move(bytes)), obj_(obj) {}

  ~AssetFiles() override;
  AssetFiles(const AssetFiles&) = delete;
  AssetFiles& operator=(const AssetFiles&) = delete;

  bool Exists(const char* name) const override;
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* mode) override;
  void Close(Assimp::IOStream* stream) override;

  unsigned others_read() const { return others_read_; }  ///< files that the mesh names
  /// The error of the last one that could not be read; empty without.
  const std::string& failure() const { return failure_; }

 private:
  std::string path_, bytes_;
  bool obj_;  ///< what it names are materials, of which assimp gets reduced_mtl()
  /// Those that are open. Assimp closes some, deletes others, and forgets those at which it gives up.
  std::set<Assimp::IOStream*> open_;
  unsigned others_read_ = 0;
  std::string failure_;
};

}  // namespace vrpipe
