#pragma once

#include <string>

#include "../ply_header.h"

namespace vrpipe {

/// What of a .ply a mesh needs: positions, normals and colours of its vertices, and its faces, in the same format. All records
/// are walked over and checked; other properties and elements are left out, so that assimp reads nothing that was not
/// checked.
/// @throws UserError for a mesh that cannot be read: records that are not whole, unknown types, no vertices or no faces, faces
///         before the vertices, more than kMaxMeshElements of an element, lists of more than 1024
std::string reduced_ply(const PlyHeader& header, const std::string& bytes, const std::string& where);

}  // namespace vrpipe
