#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vrpipe {

/// What of a glTF 2.0 document a mesh needs: the scene's nodes and their meshes, positions, normals, colours and indices, base
/// colours, and the buffers of these. All references and extents are checked; what else there is (skins, animations, images,
/// extensions) is left out, so that assimp reads nothing that was not checked.
/// @param bytes  of a .gltf or .glb; the result is of the same kind
/// @param triangles  gets how many each mesh has by its indices; the mesh's name in the result is its number
/// @throws UserError for what is no such document, lies about an extent or an index, is nested too deep, or needs an
///         extension or a sparse accessor
std::string reduced_gltf(const std::string& bytes, const std::string& where, std::vector<std::uint64_t>& triangles);

}  // namespace vrpipe
