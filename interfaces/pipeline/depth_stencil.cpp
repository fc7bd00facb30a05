#include <vrpipe/pipeline/depth_stencil.h>

#include <cmath>
#include <cstring>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {

auto fields_of(const StencilFace& face) {
  return std::tie(face.compare, face.stencil_fail, face.depth_fail, face.pass, face.reference, face.read_mask,
                  face.write_mask, face.bits);
}

/// Of a format that stores whole steps, those from 0 to 1.
constexpr std::uint32_t steps(DepthFormat format) { return format == DepthFormat::d16 ? 0xffff : 0xffffff; }

unsigned operated(StencilOperation operation, unsigned stored, unsigned reference, unsigned most) {
  switch (operation) {
    case StencilOperation::keep: return stored;
    case StencilOperation::zero: return 0;
    case StencilOperation::replace: return reference;
    case StencilOperation::increment: return stored == most ? stored : stored + 1;
    case StencilOperation::decrement: return stored == 0 ? 0 : stored - 1;
    case StencilOperation::invert: return ~stored;
    case StencilOperation::increment_wrap: return stored + 1;
    case StencilOperation::decrement_wrap: return stored - 1;
  }
  return stored;
}

}  // namespace

std::uint8_t StencilFace::apply(StencilOperation operation, std::uint8_t stored) const {
  const unsigned written = write_mask & bits;
  const unsigned value = operated(operation, stored & bits, reference & bits, bits);
  return static_cast<std::uint8_t>((stored & ~written) | (value & written));
}

bool operator==(const StencilFace& a, const StencilFace& b) { return fields_of(a) == fields_of(b); }

bool operator==(const StencilState& a, const StencilState& b) {
  return a.test == b.test && a.front == b.front && a.back == b.back;
}

bool operator==(const DepthState& a, const DepthState& b) {
  return a.test == b.test && a.compare == b.compare && a.write == b.write;
}

const char* name_of(DepthFormat format) {
  switch (format) {
    case DepthFormat::d16: return "d16";
    case DepthFormat::d24: return "d24";
    case DepthFormat::d32f: return "d32f";
  }
  return "";
}

DepthFormat depth_format_named(const std::string& name) {
  std::vector<std::string> names;
  for (const DepthFormat format : {DepthFormat::d16, DepthFormat::d24, DepthFormat::d32f}) {
    if (name == name_of(format)) return format;
    names.emplace_back(name_of(format));
  }
  throw UserError("unknown depth format '" + name + "'", "state.depth_format", "there is no such format",
                  fmt::format("use {}", fmt::join(names, ", ")));
}

std::uint32_t store_depth(DepthFormat format, double depth) {
  // So written that NaN becomes 0.
  const double clamped = depth > 0 ? (depth < 1 ? depth : 1.0) : 0.0;
  if (format != DepthFormat::d32f) return static_cast<std::uint32_t>(std::floor(clamped * steps(format) + 0.5));
  // The bits of floats that are not negative are in the order of their values.
  const auto single = static_cast<float>(clamped);
  std::uint32_t bits;
  std::memcpy(&bits, &single, sizeof bits);
  return bits;
}

double depth_of(DepthFormat format, std::uint32_t stored) {
  if (format != DepthFormat::d32f) return static_cast<double>(stored) / steps(format);
  float single;
  std::memcpy(&single, &stored, sizeof single);
  return static_cast<double>(single);
}

}  // namespace vrpipe
