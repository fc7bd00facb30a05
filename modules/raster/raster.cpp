#include "raster/raster.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {
constexpr auto tile_side = static_cast<std::int32_t>(screen_tile_pixels);
constexpr unsigned tile_bits = 4;
static_assert(1 << tile_bits == tile_side);
constexpr auto raster_side = static_cast<std::int32_t>(raster_tile_pixels);
// Within a raster tile an edge function changes by at most 7 (|dx| + |dy|). Below this bound that is under 2^30: a value
// beyond 2^30 at the tile's first sample is above 0 all over the tile, which it is as well if clamped, and none is below
// -2^30, where all of the tile is outside. So 32 bits are exact.
constexpr std::int64_t narrow_gradient = (std::int64_t{1} << 30) / 7;
constexpr std::int64_t narrow_limit = std::int64_t{1} << 30;

static_assert(offsetof(Quad, position) == 4 && offsetof(Quad, coverage) == 5);
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
// In the upper half of a quad's word, in which its position is lowest and its coverage follows in byte 1:
constexpr unsigned triangle_shift = 16;
constexpr unsigned draw_shift = 17;
/// Of a raster tile's quads row by row: the position, from the first one's.
constexpr std::uint8_t place_of(unsigned quad) {
  return static_cast<std::uint8_t>(quads_per_tile_row * (quad / 4) + quad % 4);
}

/// Of a raster tile's 4x4 quads, 4 bits each: the samples in the first so many columns, and rows.
struct SamplesBelow {
  std::array<std::uint64_t, raster_side + 1> columns{}, rows{};
};
constexpr SamplesBelow samples_below = [] {
  SamplesBelow below;
  for (unsigned line = 0; line < raster_side; ++line) {
    std::uint64_t column = 0;
    std::uint64_t row = 0;
    for (unsigned quad = 0; quad < 4; ++quad) {
      column |= std::uint64_t{0b0101} << (line % 2 + 4 * (4 * quad + line / 2));
      row |= std::uint64_t{0b0011} << (2 * (line % 2) + 4 * (quad + 4 * (line / 2)));
    }
    below.columns[line + 1] = below.columns[line] | column;
    below.rows[line + 1] = below.rows[line] | row;
  }
  return below;
}();

/// Puts those of a raster tile's quads that are covered one after the other, row by row; returns how many.
/// @param first  the upper half of the first one's word, without coverage
unsigned put_covered(Quad* out, std::uint32_t splat, std::uint32_t first, std::uint64_t coverage) {
#if defined(__AVX2__)
  // Two rows at a time, all eight quads of them, since a branch would be mispredicted too often.
  using Bytes = char __attribute__((vector_size(16)));
  using Shorts = std::int16_t __attribute__((vector_size(16)));
  using Longs = std::uint64_t __attribute__((vector_size(16)));
  // By the bits of those that are not covered: the places of the others, a byte each.
  static constexpr auto places_of = [] {
    std::array<std::uint64_t, 256> places{};
    for (unsigned empty = 0; empty < 256; ++empty) {
      unsigned put = 0;
      for (unsigned quad = 0; quad < 8; ++quad) {
        constexpr unsigned byte[] = {0, 1, 4, 5, 2, 3, 6, 7};  // as halves of words are interleaved below
        if ((empty >> quad & 1U) == 0) places[empty] |= std::uint64_t{place_of(quad)} << (8 * byte[put++]);
      }
    }
    return places;
  }();
  const auto interleave = [](Bytes even, Bytes odd) {
    return __builtin_shufflevector(even, odd, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  };
  const Longs bits{coverage, 0};
  const Bytes covered = interleave(reinterpret_cast<Bytes>(bits), reinterpret_cast<Bytes>(bits >> 4)) & 0xf;
  const auto empty = static_cast<unsigned>(__builtin_ia32_pmovmskb128(reinterpret_cast<Bytes>(covered == 0)));
  const auto put_rows = [&](Quad* to, LaneBits rows, unsigned none, std::uint32_t from) {
    const auto places = reinterpret_cast<Bytes>(Longs{places_of[none], 0});
    const auto own =
        reinterpret_cast<Shorts>(interleave(places, __builtin_ia32_pshufb128(reinterpret_cast<Bytes>(rows), places)));
    const auto widened = reinterpret_cast<LanePairBits>(
        __builtin_shufflevector(own, Shorts{}, 0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15));
    const LanePairBits upper = widened + static_cast<std::int32_t>(from);
    const LanePairBits lower = LanePairBits{} + static_cast<std::int32_t>(splat);
    const LanePairBits first_four = __builtin_shufflevector(lower, upper, 0, 8, 1, 9, 4, 12, 5, 13);
    const LanePairBits last_four = __builtin_shufflevector(lower, upper, 2, 10, 3, 11, 6, 14, 7, 15);
    std::memcpy(static_cast<void*>(to), &first_four, sizeof first_four);
    std::memcpy(static_cast<void*>(to + 4), &last_four, sizeof last_four);
  };
  // A row's coverage goes where its places point to.
  const auto rows = reinterpret_cast<LaneBits>(covered);
  const auto in_upper = static_cast<unsigned>(__builtin_popcount(~empty & 0xffU));
  put_rows(out, __builtin_shufflevector(rows, rows, 0, 0, 1, 1), empty & 0xffU, first);
  put_rows(out + in_upper, __builtin_shufflevector(rows, rows, 2, 2, 3, 3), empty >> 8U, first + place_of(8));
  return static_cast<unsigned>(__builtin_popcount(empty ^ 0xffffU));
#else
  unsigned count = 0;
  for (unsigned quad = 0; quad < 16; ++quad) {
    const auto covered = static_cast<std::uint32_t>(coverage >> (4 * quad) & all_lanes);
    const std::uint64_t bits = splat | std::uint64_t{first + place_of(quad) + (covered << 8U)} << 32U;
    std::memcpy(static_cast<void*>(out + count), &bits, sizeof bits);
    count += covered != 0 ? 1U : 0U;
  }
  return count;
#endif
}

auto product(LaneBits a, LaneBits b) {
  using Products = std::int64_t __attribute__((vector_size(sizeof(Words))));
#if defined(__AVX2__)
  // Only lower halves count.
  const LanePairBits widened[] = {__builtin_shufflevector(a, LaneBits{}, 0, 4, 1, 5, 2, 6, 3, 7),
                                  __builtin_shufflevector(b, LaneBits{}, 0, 4, 1, 5, 2, 6, 3, 7)};
  return reinterpret_cast<Products>(__builtin_ia32_pmuldq256(widened[0], widened[1]));
#else
  return __builtin_convertvector(a, Products) * __builtin_convertvector(b, Products);
#endif
}
template <class Integers>
Integers magnitude(Integers value) {
  return value < 0 ? -value : value;
}
}  // namespace

TileRasterizer::TileRasterizer(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      snapper_(context),
      time_(parameters, context),
      wide_edges_gate_(context, "raster.wide_edges"),
      binned_gate_(context, "tgc.binning"),
      ownership_gate_(context, "raster.tile_ownership"),
      by_halves_(parameters.half_tile_order),
      shares_tiles_(context.placement.gpcs > 1 && ownership_gate_.enter()) {
  if (!parameters.hi_z) return;
  hi_z_ = std::make_unique<HiZ>(context, parameters.hi_z_bits);
  if (!hi_z_->is_used()) hi_z_.reset();
}

void TileRasterizer::update(const HiZUpdate& update) {
  if (hi_z_ == nullptr) return;
  hi_z_updates += update.mark == Mark::none ? 1 : 0;
  hi_z_->update(update);
}

void TileRasterizer::hold_as(const Behaviour& other) {
  if (hi_z_ != nullptr) hi_z_->hold_as(*dynamic_cast<const TileRasterizer&>(other).hi_z_);
}

void TileRasterizer::begin(const Primitive& primitive, const PixelRect& clip) {
  ++setups;
  primitive_ = primitive;
  first_bits_ = std::uint32_t{primitive.triangle} << triangle_shift | std::uint32_t{primitive.draw} << draw_shift;
  area_ = primitive.bounds;
  // A primitive covers nothing outside its bounds, so those need no masking.
  const bool whole = clip.x0 <= primitive.bounds.x0 && clip.y0 <= primitive.bounds.y0 &&
                     clip.x1 >= primitive.bounds.x1 && clip.y1 >= primitive.bounds.y1;
  const auto width = static_cast<std::int32_t>(context_.frame->width());
  const auto height = static_cast<std::int32_t>(context_.frame->height());
  mask_area_ = {0, 0, width, height};
  if (!whole && binned_gate_.enter()) {
    area_ = intersection(area_, clip);
    mask_area_ = intersection(mask_area_, clip);
  }
  // No side is negative.
  tile_x_begin_ = area_.x0 >> tile_bits;
  tile_x_end_ = (area_.x1 + tile_side - 1) >> tile_bits;
  next_x_ = tile_x_begin_;
  next_y_ = area_.y0 >> tile_bits;
  tile_y_end_ = area_.empty() ? next_y_ : (area_.y1 + tile_side - 1) >> tile_bits;
  is_masked_ = mask_area_.x0 > tile_x_begin_ * tile_side || mask_area_.x1 < tile_x_end_ * tile_side ||
               mask_area_.y0 > next_y_ * tile_side || mask_area_.y1 < tile_y_end_ * tile_side;
  left_ = kept_ = 0;

  tests_hi_z_ = hi_z_ != nullptr && hi_z_->begin(primitive);
  if (draws_rectangles(context_.draw(primitive.draw))) return set_up_rectangle();
  SnappedTriangle t;
  if (!snapper_.snap(primitive.draw, primitive.splat, primitive.triangle, t)) {
    throw SimulationFault("raster", 0, "primitive of splat " + std::to_string(primitive.splat) + " has no vertices");
  }
  if (doubled_area(t) < 0) {
    std::swap(t.x[1], t.x[2]);
    std::swap(t.y[1], t.y[2]);
  }
  // Positive inside, y down: E(x, y) = (xj - xi)(y - yi) - (yj - yi)(x - xi), j after i. The fourth edge is the third.
  const unsigned bits = context_.precision.subpixel_bits;
  const std::int32_t step = std::int32_t{1} << bits;
  const LaneBits x{t.x[0], t.x[1], t.x[2], t.x[2]};
  const LaneBits y{t.y[0], t.y[1], t.y[2], t.y[2]};
  const LaneBits across = __builtin_shufflevector(x, x, 1, 2, 0, 0) - x;
  const LaneBits down = __builtin_shufflevector(y, y, 1, 2, 0, 0) - y;
  // A sample on an edge belongs to the triangle if the edge is a top edge (horizontal, inside below it) or a left
  // edge (inside to its right); on any other edge it does not, which one less says in integers.
  const LaneBits is_top_left = ((down == 0) & (across > 0)) | (down < 0);
  const OfEdges origin = product(across, (step >> 1) - y) - product(down, (step >> 1) - x) +
                         __builtin_convertvector(~is_top_left, OfEdges);
  at_next_ = at_row_ = origin + product(across, LaneBits{} + next_y_ * tile_side * step) -
                       product(down, LaneBits{} + tile_x_begin_ * tile_side * step);
  const LaneBits wide = magnitude(across) + magnitude(down) > static_cast<std::int32_t>(narrow_gradient >> bits);
  wide_ = sign_mask(wide) != 0;
  const OfEdges most = magnitude(origin) + product(magnitude(down), LaneBits{} + width * step) +
                       product(magnitude(across), LaneBits{} + height * step);
  if (wide_ && !wide_edges_gate_.enter()) wide_ = false;
  if (wide_) ++wide_edges;
  widest_edge.see(static_cast<std::uint64_t>(
      65 - __builtin_clzll(static_cast<unsigned long long>(most[0] | most[1] | most[2] | 1))));
  dx_ = product(-down, LaneBits{} + step);
  dy_ = product(across, LaneBits{} + step);
  set_up_tiles();
}

void TileRasterizer::set_up_tiles() {
  right_ = tile_side * dx_;
  below_ = tile_side * dy_;
  next_column_ = 2 * dx_;
  lower_quads_ = 4 * dy_;
  at_part_[1] = raster_side * dx_;
  at_part_[2] = raster_side * dy_;
  at_part_[3] = at_part_[1] + at_part_[2];
  // The largest value over a tile's samples is at the corner to which the gradient points.
  const OfEdges reach = (raster_side - 1) * ((dx_ & (dx_ > 0)) + (dy_ & (dy_ > 0)));
  for (unsigned i = 0; i < 3; ++i) {
    most_in_parts_[i] = (OfParts{0, -1, 0, -1} & at_part_[1][i]) + (OfParts{0, 0, -1, -1} & at_part_[2][i]) + reach[i];
    // Of edges that are too wide, which are filled by these only if that effect was left out by force, the low bits.
    const auto across = static_cast<std::int32_t>(dx_[i]);
    const auto down = static_cast<std::int32_t>(dy_[i]);
    samples_[i] = across * LanePairBits{0, 1, 0, 1, 0, 1, 0, 1} + down * LanePairBits{0, 0, 1, 1, 2, 2, 3, 3};
  }
}

/// It covers its bounds: edges that have no sample outside, and all beyond the bounds masked off.
void TileRasterizer::set_up_rectangle() {
  wide_ = false;
  at_next_ = at_row_ = OfEdges{};
  dx_ = dy_ = OfEdges{};
  set_up_tiles();
  mask_area_ = area_;
  is_masked_ = true;
}

std::int32_t TileRasterizer::x_of(unsigned part) const {
  return tile_.x * tile_side + static_cast<std::int32_t>(part & 1U) * raster_side;
}
std::int32_t TileRasterizer::y_of(unsigned part) const {
  return tile_.y * tile_side + static_cast<std::int32_t>(part >> 1U) * raster_side;
}

inline bool TileRasterizer::enter_tile() {
  while (next_y_ < tile_y_end_) {
    tile_ = {static_cast<std::uint16_t>(next_x_), static_cast<std::uint16_t>(next_y_)};
    at_tile_ = at_next_;
    at_next_ += right_;
    if (++next_x_ == tile_x_end_) {
      next_x_ = tile_x_begin_;
      ++next_y_;
      at_next_ = at_row_ += below_;
    }
    if (shares_tiles_ && !context_.placement.owns(tile_)) continue;
    const std::int32_t middle_x = x_of(1);
    const std::int32_t middle_y = y_of(2);
    // Some raster tile of it lies in the area.
    left_ = ((middle_x > area_.x0 ? 0b0101U : 0U) | (middle_x < area_.x1 ? 0b1010U : 0U)) &
            ((middle_y > area_.y0 ? 0b0011U : 0U) | (middle_y < area_.y1 ? 0b1100U : 0U));
    OfParts most{};
    for (unsigned i = 0; i < 3; ++i) most |= most_in_parts_[i] + at_tile_[i];
    kept_ = left_ & ~sign_mask(reinterpret_cast<Words>(most));
    tile_counted_ = false;
    return true;
  }
  return false;
}

void TileRasterizer::tell(const QuadBeat& made) const {
  for (unsigned i = 0; i < made.count; ++i) {
    const Quad& quad = made.quads[i];
    context_.fragments->happened(FragmentFate::rasterized, made.tile, quad.position, quad.coverage);
  }
}

bool TileRasterizer::next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) {
  unsigned tests = 0;
  while (true) {
    while (kept_ == 0) {
      tests += popcount(static_cast<LaneMask>(left_));
      left_ = 0;
      if (enter_tile()) continue;
      coarse_tests = tests;
      raster_tiles_tested += tests;
      return false;
    }
    const auto part = static_cast<unsigned>(__builtin_ctz(kept_));
    const unsigned up_to_part = kept_ ^ (kept_ - 1);
    tests += popcount(static_cast<LaneMask>(left_ & up_to_part));
    left_ &= ~up_to_part;
    kept_ &= kept_ - 1;
    if (tests_hi_z_ && is_hidden(part)) continue;

    out.tile = tile_;
    out.last_of_bin = false;
    out.mark = Mark::none;
    const OfEdges value = at_tile_ + at_part_[part];
    std::uint64_t covered = wide_ ? coverage_of_wide(value) : coverage_of_narrow(value);
    if (is_masked_) covered &= in_area(part);
    const std::uint32_t first = first_bits_ | 4 * quads_per_tile_row * (part >> 1U) | 4 * (part & 1U);
    out.count = static_cast<std::uint8_t>(put_covered(out.quads.data(), primitive_.splat, first, covered));
    if (by_halves_) take_by_halves(out);
    quads_rasterized.add(primitive_.draw, out.count);
    fragments_rasterized.add(primitive_.draw, static_cast<unsigned>(__builtin_popcountll(covered)));
    if (context_.fragments != nullptr) tell(out);
    coarse_tests = tests;
    raster_tiles_tested += tests;
    ++raster_tiles_kept;
    new_screen_tile = !tile_counted_;
    screen_tile_pairs += new_screen_tile ? 1 : 0;
    tile_counted_ = true;
    return true;
  }
}

void TileRasterizer::take_by_halves(QuadBeat& tile) {
  const QuadBeat rows = tile;
  unsigned taken = 0;
  for (const unsigned half : {0U, 2U}) {
    for (unsigned i = 0; i < rows.count; ++i) {
      if ((rows.quads[i].position & 2U) == half) tile.quads[taken++] = rows.quads[i];
    }
  }
}

bool TileRasterizer::is_hidden(unsigned part) {
  ++hi_z_tests;
  const std::int32_t x = x_of(part);
  const std::int32_t y = y_of(part);
  const PixelRect area{std::max(x, area_.x0), std::max(y, area_.y0), std::min(x + raster_side, area_.x1),
                       std::min(y + raster_side, area_.y1)};
  const bool is_hidden = hi_z_->hides(tile_, part, area);
  hi_z_culled += is_hidden ? 1 : 0;
  return is_hidden;
}

inline std::uint64_t TileRasterizer::in_area(unsigned part) const {
  const std::int32_t x = x_of(part);
  const std::int32_t y = y_of(part);
  const auto up_to = [](std::int32_t line) { return static_cast<std::size_t>(std::clamp(line, 0, raster_side)); };
  const auto& [columns, rows] = samples_below;
  return columns[up_to(mask_area_.x1 - x)] & ~columns[up_to(mask_area_.x0 - x)] & rows[up_to(mask_area_.y1 - y)] &
         ~rows[up_to(mask_area_.y0 - y)];
}

inline std::uint64_t TileRasterizer::coverage_of_narrow(const OfEdges& value) const {
  // The quads of a column in two rows at a time. No edge function may be negative inside.
  const OfEdges limit = OfEdges{} + narrow_limit;
  const OfEdges at_first = value > limit ? limit : value;
  LanePairBits at_half[3];
  for (unsigned i = 0; i < 3; ++i) at_half[i] = samples_[i] + static_cast<std::int32_t>(at_first[i]);
  std::uint64_t outside = 0;
  for (unsigned half = 0; half < 2; ++half) {
    LanePairBits at[] = {at_half[0], at_half[1], at_half[2]};
    LanePairBits of_column[4];
    for (LanePairBits& any : of_column) {
      any = at[0] | at[1] | at[2];
      for (unsigned i = 0; i < 3; ++i) at[i] += static_cast<std::int32_t>(next_column_[i]);
    }
    outside |= std::uint64_t{sign_masks(of_column)} << (32 * half);
    for (unsigned i = 0; i < 3; ++i) at_half[i] += static_cast<std::int32_t>(lower_quads_[i]);
  }
  return ~outside;
}

std::uint64_t TileRasterizer::coverage_of_wide(const OfEdges& value) const {
  std::uint64_t coverage = 0;
  for (unsigned sample = 0; sample < 64; ++sample) {
    const unsigned quad = sample / 4;
    const unsigned x = 2 * (quad % 4) + sample % 2;
    const unsigned y = 2 * (quad / 4) + sample / 2 % 2;
    bool inside = true;
    for (unsigned i = 0; i < 3; ++i) inside = inside && value[i] + dx_[i] * x + dy_[i] * y >= 0;
    coverage |= std::uint64_t{inside} << sample;
  }
  return coverage;
}

namespace {
const SlotRegistrar raster_slot{{"raster", 40, "tile-rasterizer", "", true, check_raster}};
const Registrar<TileRasterizer, RasterBehaviour> registrar(
    "raster", "tile-rasterizer", "fixed-point edge functions, 8x8 raster tiles, top-left rule", false, Trust::trusted);

const EffectRegistrar wide_edges_effect{
    {"raster",
     "wide_edges",
     "tile-rasterizer",
     EffectKind::functional,
     "edge functions of large triangles, in 64 bits instead of 32",
     "the largest primitive's edges change by less than 2^30 over a raster tile; else until one's do not",
     "a sample-by-sample fill beside that of 32 bits",
     "at set-up, where an edge is too steep for 32 bits",
     {},
     [](const EffectQuestion& asked) {
       const double steps = 1U << asked.context.precision.subpixel_bits;
       const double widest = static_cast<double>(narrow_gradient) / (steps * steps);
       const double here = asked.facts.widest_edge;
       const std::string numbers =
           fmt::format("the widest edge is at most {:.0f} px; 32 bits hold {:.0f}", here, widest);
       return here < widest ? EffectDecision::omit(numbers) : EffectDecision::watch(numbers);
     }}};
const EffectRegistrar tile_ownership_effect{{"raster",
                                             "tile_ownership",
                                             "tile-rasterizer",
                                             EffectKind::functional,
                                             "screen tiles that belong to other GPCs: each rasterises its own",
                                             "there is one GPC",
                                             "a test of each screen tile",
                                             "at elaboration, where there are others",
                                             {},
                                             [](const EffectQuestion& asked) {
                                               const unsigned gpcs = asked.context.placement.gpcs;
                                               if (gpcs == 1)
                                                 return EffectDecision::omit("one GPC has all screen tiles");
                                               return EffectDecision::keep(
                                                   fmt::format("{} GPCs share the screen tiles", gpcs));
                                             }}};
}  // namespace

}  // namespace vrpipe
