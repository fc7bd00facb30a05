#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/draw.h>

namespace vrpipe {

namespace {

class CheckedDraw final : public CheckedSlot<DrawBehaviour> {
 public:
  CheckedDraw(std::string name, const RenderContext& context, std::unique_ptr<DrawBehaviour> checked)
      : CheckedSlot(std::move(name), context, std::move(checked)) {
    for (std::size_t command = 0; command < frame().commands().size(); ++command) {
      if (frame().commands()[command].is_draw) command_of_draw_.push_back(command);
    }
  }

  bool next(VertexWarp& out) override {
    if (!ask("next", [&] { return checked_->next(out); })) {
      pass(frame().commands().size());
      return false;
    }
    if (out.mark != Mark::none) {
      const std::size_t command = static_cast<std::size_t>(out.mark) - 1;
      if (command < passed_ || command >= frame().commands().size()) {
        fault("next", "a mark of command {}, of which {} of {} have passed", command, passed_,
              frame().commands().size());
      }
      pass(command);
      return true;
    }
    if (out.splats == 0 || out.splats > most_splats(out.draw)) fault("next", "a warp of {} splats", out.splats);
    const std::uint64_t end = out.first_splat + std::uint64_t{out.splats};
    if (out.first_splat < issued_ || end > frame().splats()) {
      fault("next", "a warp of splats {} to {}, after {} of {}", out.first_splat, end - 1, issued_, frame().splats());
    }
    check_splat("next", out.draw, out.first_splat);
    check_splat("next", out.draw, static_cast<std::uint32_t>(end - 1));
    issued_ = out.first_splat + out.splats;
    const std::size_t command = command_of_draw_[out.draw];
    if (command + 1 < passed_) {
      fault("next", "a warp of draw {}, command {}, behind the mark of command {}", out.draw, command, passed_ - 1);
    }
    if (command + 1 > passed_) {
      if (needs_mark(command)) fault("next", "a warp of draw {} without the mark of command {}", out.draw, command);
      pass(command);
    }
    return true;
  }
  std::uint32_t warps_per_1024_cycles() const override {
    return rate_of("warps_per_1024_cycles", [&] { return checked_->warps_per_1024_cycles(); });
  }
  std::uint32_t rectangle_warps_per_1024_cycles() const override {
    return rate_of("rectangle_warps_per_1024_cycles", [&] { return checked_->rectangle_warps_per_1024_cycles(); });
  }
  void check_timing() const override {
    warps_per_1024_cycles();
    rectangle_warps_per_1024_cycles();
  }
  void check_counters() const override {}

 private:
  template <class Question>
  std::uint32_t rate_of(const char* name, Question&& question) const {
    const std::uint32_t rate = ask(name, question);
    check_rate(name, rate);
    return rate;
  }
  /// Of a warp, whose threads are vertices.
  std::uint32_t most_splats(DrawIndex draw) const {
    const bool rectangles =
        draw < frame().draws().size() && frame().draw_call(draw).state.splat_extent == SplatExtent::fill_rectangle;
    constexpr unsigned threads = splats_per_vertex_warp * vertices_per_splat;
    return rectangles ? (threads + vertices_per_rectangle - 1) / vertices_per_rectangle : splats_per_vertex_warp;
  }
  bool needs_mark(std::size_t command) const {
    const Frame::Command& of = frame().commands()[command];
    return !of.is_draw || of.changes_state;
  }
  /// A command and those before it, whose marks have to have come.
  void pass(std::size_t command) {
    for (; passed_ < command; ++passed_) {
      if (needs_mark(passed_)) fault("next", "no mark of command {}", passed_);
    }
    passed_ = command + 1;
  }

  std::uint32_t issued_ = 0;  ///< up to this splat
  std::size_t passed_ = 0;    ///< commands
  std::vector<std::size_t> command_of_draw_;
};

}  // namespace

std::unique_ptr<Behaviour> check_draw(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedDraw, DrawBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
