#pragma once

#include <string>

#include <vrpipe/workloads/mesh.h>

namespace vrpipe {

/// What of an .obj a mesh needs: well-formed positions, normals and faces, and the materials these use. Faces whose indices
/// lie are left out and counted, as lines and points are; all other statements are left out. Normals are, too, unless all
/// faces have them. Assimp reads nothing that was not checked. Empty when no face is left.
/// @throws UserError for a position, a normal or a face that is malformed, or a face of more than 1024 corners
std::string reduced_obj(const std::string& text, const std::string& where, RejectedTriangles& rejected);

/// What of an .mtl a mesh needs: names and diffuse colours. What is malformed is left out.
std::string reduced_mtl(const std::string& text);

}  // namespace vrpipe
