#pragma once

#include <string>

#include "../ply_header.h"

namespace vrpipe {

/// Walks over all records of a .ply mesh, binary or ASCII, so that its reader meets none that is cut short or whose lists are
/// longer than the file.
/// @throws UserError for a mesh that cannot be read: records that are not whole, unknown types, two elements of one name, no
///         faces, faces before the vertices, more than kMaxMeshElements of an element
void check_ply_records(const PlyHeader& header, const std::string& bytes, const std::string& where);

}  // namespace vrpipe
