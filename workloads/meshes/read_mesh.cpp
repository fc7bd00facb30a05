#include <algorithm>
#include <cstring>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include <assimp/BaseImporter.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/mesh.h>

#include "../file_io.h"
#include "../glb.h"
#include "../ply_header.h"
#include "asset_files.h"
#include "gltf_document.h"
#include "import_asset.h"
#include "obj_document.h"
#include "ply_document.h"

namespace vrpipe {
namespace {

constexpr std::uint64_t kMostGltfText = std::uint64_t{64} << 20U;

PlyHeader header_of(const std::filesystem::path& path, const std::string& what, const std::string& export_remedy) {
  const InputFile file(path, what);
  std::string head(static_cast<std::size_t>(std::min<std::uint64_t>(file.size(), kMaxPlyHeaderBytes)), '\0');
  file.read(0, head.data(), head.size());
  return read_ply_header(head, what, path.string(), export_remedy);
}

bool is_gltf(const std::string& extension) { return extension == ".gltf" || extension == ".glb"; }

/// Of a .glb or .gltf.
bool has_gltf_gaussians(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;
  const InputFile file(path, "cannot read scene");
  GlbStart start{};
  std::uint64_t from = 0, size = file.size();
  if (size >= sizeof start) file.read(0, &start, sizeof start);
  if (std::memcmp(start.magic, kGlbMagic, sizeof start.magic) == 0) {
    from = sizeof start;
    size = std::min<std::uint64_t>(start.document.bytes, size - from);
  }
  std::string text(static_cast<std::size_t>(std::min<std::uint64_t>(size, kMostGltfText)), '\0');
  file.read(from, text.data(), text.size());
  if (from == 0 && !text.empty() && !begins_as_gltf(text)) {
    throw UserError("cannot read scene", path.string(), kNoGltf, "get the file again, or name it by its format");
  }
  return mentions_gaussians(text);
}

/// Leaves assimp the reader of one format: another one would be taken for a file that only looks like it.
void keep_one_reader(Assimp::Importer& importer, const std::string& extension) {
  const std::string name = extension == ".obj"   ? "Wavefront Object Importer"
                           : extension == ".ply" ? "Stanford Polygon Library (PLY) Importer"
                                                 : "glTF2 Importer";
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    if (importer.GetImporterInfo(i)->mName == name) continue;
    Assimp::BaseImporter* const reader = importer.GetImporter(i);
    importer.UnregisterLoader(reader);
    delete reader;
  }
}

[[noreturn]] void fail(const std::string& where, const std::string& why) {
  constexpr std::size_t kLongest = 300;
  throw UserError(kCannotReadMesh, where, why.empty() ? "it is not a mesh of its type" : why.substr(0, kLongest),
                  "export it again as .obj, .ply, .gltf or .glb");
}

Mesh import_mesh(const std::string& path, const std::string& extension, std::string bytes,
                 RejectedTriangles& rejected) {
  std::vector<std::uint64_t> triangles;
  if (is_gltf(extension)) bytes = reduced_gltf(bytes, path, triangles);
  if (extension == ".obj") bytes = reduced_obj(bytes, path, rejected);
  if (bytes.empty()) return {};
  if (extension == ".ply")
    bytes = reduced_ply(header_of(path, kCannotReadMesh, "export the mesh as a .ply"), bytes, path);
  Assimp::Importer importer;
  keep_one_reader(importer, extension);
  auto* files = new AssetFiles(path, std::move(bytes), extension == ".obj");  // the importer deletes it
  importer.SetIOHandler(files);
  if (importer.ReadFile(path, 0) == nullptr) {
    fail(path, files->failure().empty() ? importer.GetErrorString() : files->failure());
  }
  ColourRule rule = ColourRule::as_they_are;
  if (is_gltf(extension)) rule = ColourRule::linear_and_product;
  if (extension == ".obj" && files->others_read() == 0) rule = ColourRule::white_material;
  if (is_gltf(extension)) rejected.index_out_of_range += triangles_left_out(*importer.GetScene(), triangles);
  // The importer's scene is its own, and const for others alone.
  remove_bad_faces(const_cast<aiScene&>(*importer.GetScene()), path, rejected);
  const aiScene* const scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (scene == nullptr) fail(path, importer.GetErrorString());
  return mesh_of_scene(*scene, rule, path);
}

}  // namespace

bool is_mesh_file(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  if (is_gltf(extension)) return !has_gltf_gaussians(path);
  if (extension == ".obj") return true;
  if (extension != ".ply") return false;
  const PlyHeader header = header_of(path, "cannot read scene", "export the scene as a .ply");
  const PlyElement* const vertex = header.element("vertex");
  const bool gaussians = vertex != nullptr && std::any_of(vertex->properties.begin(), vertex->properties.end(),
                                                          [](const PlyProperty& p) { return p.name == "f_dc_0"; });
  return header.element("face") != nullptr && !gaussians;
}

Mesh read_mesh(const std::filesystem::path& path, RejectedTriangles& rejected) {
  const std::string where = path.string(), extension = extension_of(path);
  if (extension != ".obj" && extension != ".ply" && !is_gltf(extension)) {
    throw UserError(kCannotReadMesh, where,
                    extension.empty() ? "it has no extension" : "meshes of type `" + extension + "` are not supported",
                    "give an .obj, .ply, .gltf or .glb");
  }
  std::string bytes = read_mesh_file(where);
  RejectedTriangles here;
  Mesh mesh;
  try {
    mesh = import_mesh(where, extension, std::move(bytes), here);
  } catch (const UserError&) {
    throw;
  } catch (const std::exception& error) {
    fail(where, error.what());
  }
  reject_triangles(mesh, here);
  if (mesh.empty()) {
    throw UserError(kCannotReadMesh, where,
                    "no triangle of it can be drawn: " + std::to_string(here.not_finite) + " are not finite, " +
                        std::to_string(here.index_out_of_range) + " have indices beyond the vertices, " +
                        std::to_string(here.degenerate) + " have no area; " + std::to_string(here.lines_and_points) +
                        " lines and points",
                    is_gltf(extension) && has_gltf_gaussians(path)
                        ? "it has Gaussians (KHR_gaussian_splatting): give it as --scene"
                        : "export it again, with faces");
  }
  rejected.not_finite += here.not_finite;
  rejected.index_out_of_range += here.index_out_of_range;
  rejected.degenerate += here.degenerate;
  rejected.lines_and_points += here.lines_and_points;
  return mesh;
}

}  // namespace vrpipe
