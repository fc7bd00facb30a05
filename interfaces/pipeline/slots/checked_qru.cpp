#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/qru.h>

namespace vrpipe {

namespace {

class CheckedQru final : public CheckedSlot<QruBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  unsigned examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) override {
    tile_ = tile;
    const unsigned examined = ask("examine", [&] { return checked_->examine(tile, quads, count, out, launched); });
    if (examined > count) fault("examine", "{} quads examined of {} in {}", examined, count, words_of(tile));
    if (examined < count && !launched) {
      fault("examine", "{} quads examined of {} in {}, and no warp launched", examined, count, words_of(tile));
    }
    held_ += examined;
    if (launched) check_warp("examine", out);
    return examined;
  }
  bool finish_bin(Warp& out) override {
    if (!ask("finish_bin", [&] { return checked_->finish_bin(out); })) {
      if (held_ != 0) fault("finish_bin", "{} quads of {} are in no warp", held_, words_of(tile_));
      return false;
    }
    check_warp("finish_bin", out);
    return true;
  }
  Throughput timing() const override {
    const Throughput timing = ask("timing", [&] { return checked_->timing(); });
    check_throughput(timing);
    return timing;
  }
  std::uint64_t storage_bytes() const override {
    return ask("storage_bytes", [&] { return checked_->storage_bytes(); });
  }
  void check_timing() const override { timing(); }
  void check_counters() const override {}

 private:
  void check_warp(const char* call, const Warp& warp) {
    if (warp.tile != tile_) fault(call, "a warp of {} in the bin of {}", words_of(warp.tile), words_of(tile_));
    if (warp.count == 0 || warp.count > quads_per_warp) {
      fault(call, "a warp of {} quads in {}, and it has 1 to {}", warp.count, words_of(tile_), quads_per_warp);
    }
    if (warp.mark != Mark::none) fault(call, "a warp of {} that is a mark", words_of(tile_));
    check_quads(call, tile_, warp.quads.data(), warp.count);
    const bool may_merge = frame().draws().empty() || frame().draw_call(warp.quads[0].draw).state.merges();
    if (warp.merge_pairs != 0 && !may_merge) {
      fault(call, "pairs in a warp of {}, which is of a draw that is tested late or not blended", words_of(tile_));
    }
    for (unsigned pair = 0; 2 * pair < 8; ++pair) {
      if ((warp.merge_pairs >> pair & 1U) == 0) continue;
      if (pair >= quads_per_warp / 2 || 2 * pair + 1 >= warp.count ||
          warp.quads[2 * pair].position != warp.quads[2 * pair + 1].position) {
        fault(call, "pair {} of a warp of {} quads in {} is no two quads of a position", pair, warp.count,
              words_of(tile_));
      }
    }
    if (warp.count > held_)
      fault(call, "a warp of {} quads in {}, where {} were left", warp.count, words_of(tile_), held_);
    held_ -= warp.count;
  }

  TileId tile_;
  std::uint64_t held_ = 0;  ///< quads examined that are in no warp yet
};

}  // namespace

std::unique_ptr<Behaviour> check_qru(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedQru, QruBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
