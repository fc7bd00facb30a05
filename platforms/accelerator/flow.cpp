#include "accelerator/flow.h"

#include <algorithm>
#include <array>

namespace vrpipe {

std::uint64_t AcceleratorFlow::memory_time(std::uint64_t bytes) const {
  // Megabytes a second are bytes a microsecond, megahertz cycles of one. Whole microseconds first: the product may not fit.
  const std::uint64_t of_a_microsecond = timing_.memory_mb_per_second;
  const std::uint64_t thousandths = std::uint64_t{1000} * timing_.frequency_mhz;
  return bytes / of_a_microsecond * thousandths +
         (bytes % of_a_microsecond * thousandths + of_a_microsecond - 1) / of_a_microsecond;
}

std::uint64_t AcceleratorFlow::alone(const AcceleratorStep::Part& part) const {
  return std::max(1000 * part.cycles, memory_time(part.bytes));
}

std::uint64_t AcceleratorFlow::bound(const std::vector<AcceleratorStep>& steps) const {
  std::uint64_t least = 0, bytes = 0;
  std::array<std::uint64_t, accelerator_stages> until{};  // work of each stage up to the step that is looked at
  std::array<std::uint64_t, accelerator_stages> head{};   // before the first work of each
  std::array<std::uint64_t, accelerator_stages> tail{};
  for (const AcceleratorStep& step : steps) {
    for (std::size_t stage = 0; stage < accelerator_stages; ++stage) {
      const std::uint64_t work = alone(step.parts[stage]);
      if (until[stage] == 0 && work > 0) {
        // Steps up to this one have passed every stage before, each of them one after the other.
        std::uint64_t latencies = 0;
        for (std::size_t before = stage; before-- > 0;) {
          latencies += latency(before);
          head[stage] = std::max(head[stage], until[before] + latencies);
        }
      }
      until[stage] += work;
      bytes += step.parts[stage].bytes;
    }
  }
  for (std::size_t stage = accelerator_stages; stage-- > 0;) {
    tail[stage] = latency(stage) + (stage + 1 < accelerator_stages ? tail[stage + 1] : 0);
    if (until[stage] > 0) least = std::max(least, head[stage] + until[stage] + tail[stage]);
  }
  return std::max(least, memory_time(bytes));
}

std::uint64_t AcceleratorFlow::end(const std::vector<AcceleratorStep>& steps) const {
  constexpr std::uint64_t not_yet = ~std::uint64_t{0};
  constexpr std::size_t last = accelerator_stages - 1;
  if (steps.empty()) return 0;
  std::array<std::vector<std::uint64_t>, accelerator_stages> ends;
  std::array<std::size_t, accelerator_stages> next{};
  for (std::vector<std::uint64_t>& of_stage : ends) of_stage.resize(steps.size());
  // When a stage can begin its next step, or not_yet where what that waits for has not begun.
  const auto ready = [&](std::size_t stage) {
    const std::size_t step = next[stage];
    if (step == steps.size()) return not_yet;
    std::uint64_t time = step > 0 ? ends[stage][step - 1] : 0;
    if (stage > 0) {
      if (step >= next[stage - 1]) return not_yet;
      time = std::max(time, ends[stage - 1][step] + latency(stage - 1));
    }
    if (stage < last && step >= timing_.buffers) {
      const std::size_t out = step - timing_.buffers;  // whose room it takes
      if (out >= next[stage + 1]) return not_yet;
      time = std::max(time, ends[stage + 1][out]);
    }
    return time;
  };
  std::uint64_t memory_free = 0;
  while (next[last] < steps.size()) {
    // The earliest, so that the memory is asked in the order of time; of several the last stage, which makes room.
    std::size_t chosen = 0;
    std::uint64_t earliest = not_yet;
    for (std::size_t stage = 0; stage < accelerator_stages; ++stage) {
      const std::uint64_t time = ready(stage);
      if (time != not_yet && time <= earliest) {
        earliest = time;
        chosen = stage;
      }
    }
    const std::size_t step = next[chosen]++;
    const AcceleratorStep::Part& part = steps[step].parts[chosen];
    std::uint64_t done = earliest + 1000 * part.cycles;
    if (part.bytes > 0) {
      memory_free = std::max(memory_free, earliest) + memory_time(part.bytes);
      done = std::max(done, memory_free);
    }
    ends[chosen][step] = done;
  }
  return ends[last].back() + latency(last);
}

}  // namespace vrpipe
