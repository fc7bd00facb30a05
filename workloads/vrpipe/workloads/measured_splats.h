#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/pipeline/draw.h>

/// Splats that a real GPU was measured with, made again from the random numbers that they were made with: the same splats in
/// the same order. Their boxes are those that were drawn; nothing is to be added to them (DrawState::obb_padding).
namespace vrpipe::measured {

/// Splats of half axes of a and b pixels and of one opacity, turned at random, with centres anywhere in the upper left
/// `region` x `region` pixels of an image of `equal_splats_side` squared.
std::vector<Splat> equal_splats(double a, double b, float opacity, std::uint64_t count, double region);
inline constexpr std::uint32_t equal_splats_side = 1024;

/// Splats of all sizes, some in clusters: "object", "sweep-50k" or "size-25". Throws std::logic_error for any other name.
Draw synthetic_scene(const std::string& name, std::uint32_t width, std::uint32_t height, std::uint64_t splats);
const std::vector<std::string>& synthetic_scene_names();

}  // namespace vrpipe::measured
