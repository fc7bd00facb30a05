#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/slots/qru.h>

namespace vrpipe {

/// Quad reorder unit (paper 5.3): 64 position registers pair overlapping quads of a bin, a 128-bit bitmap tells which
/// are left for the end. A register that holds a quad means a pair, and is then empty again. Quads of draws that are tested
/// late or not blended pass by the registers.
class PairingQru : public QruBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer bin_quads{*this,
                      "bin_quads",
                      128,
                      1,
                      4096,
                      "quads",
                      source::paper_table,
                      "quads buffered; a larger bin is examined in parts"};
    Integer quads_per_cycle{*this,
                            "quads_per_cycle",
                            8,
                            1,
                            16,
                            "quads",
                            source::open,
                            "examined in a cycle, a warp's worth; below 3 merging loses more than it gains"};
    Integer latency_cycles{*this,
                           "latency_cycles",
                           4,
                           1,
                           1000,
                           "cycles",
                           source::open,
                           "from the quad that completes a warp to its launch"};
  };
  PairingQru(const Parameters& parameters, const RenderContext& context);

  unsigned examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) override;
  bool finish_bin(Warp& out) override;
  Throughput timing() const override { return {quads_per_cycle_, latency_cycles_}; }
  /// (4 B pointer + 6-bit position) x quads + 64 x 1 B register + bitmap (paper, table of hardware cost).
  std::uint64_t storage_bytes() const override;

 private:
  static constexpr std::uint16_t no_quad = 0xffff;
  static constexpr unsigned bits_per_word = 64;
  void launch(Warp& out);
  unsigned pass_by(const Quad* quads, unsigned count, Warp& out, bool& launched);

  const RenderContext& context_;
  const bool any_unmerged_;
  const std::uint32_t bin_quads_;
  const std::uint32_t quads_per_cycle_;
  const std::uint32_t latency_cycles_;
  std::vector<Quad> buffer_;           ///< by quad id
  std::vector<std::uint64_t> single_;  ///< the bitmap: buffered quads without a partner
  std::array<std::uint16_t, positions_per_tile> registers_;
  Warp warp_;                   ///< being filled
  std::uint32_t buffered_ = 0;  ///< quads in the buffer
  std::uint32_t left_ = 0;      ///< word of the bitmap to look at for the left-over warps
};

/// The baseline: quads of a bin become warps in the order in which they come.
class QruPassThrough : public QruBehaviour {
 public:
  struct Parameters : ParameterSet {};
  QruPassThrough(const Parameters&, const RenderContext&) {}

  unsigned examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) override;
  bool finish_bin(Warp& out) override;
  Throughput timing() const override { return {QuadBeat::capacity, 1}; }
  std::uint64_t storage_bytes() const override { return 0; }

 private:
  void launch(Warp& out);

  Warp warp_;
};

}  // namespace vrpipe
