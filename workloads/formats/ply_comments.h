#pragma once

#include <vrpipe/workloads/gaussian_file.h>

#include "ply_header.h"

namespace vrpipe {

/// What the comments of a .ply's header say of how its Gaussians are to be drawn: the axis that points up ("Vertical axis: z" of
/// nerfstudio, "Vertical axis: 0 0 1" of Brush), and that they were trained anti-aliased ("SplatRenderMode: mip" of Brush and
/// splat-transform, "antialiased 1" of Postshot). In upper or lower case.
void apply_ply_comments(const PlyHeader& header, GaussianFile& file);

/// The comments that say the same of `file`; empty where nothing is to be said.
std::string ply_comments_of(const GaussianFile& file);

}  // namespace vrpipe
