#pragma once

#include <atomic>
#include <cstdint>
#include <system_error>
#include <thread>
#include <vector>

namespace vrpipe {

/// Runs work(chunk) for chunk 0 .. chunks-1 on up to `threads` threads, whichever is free.
template <class Work>
void for_each_chunk(std::uint64_t chunks, unsigned threads, const Work& work) {
  std::atomic<std::uint64_t> next{0};
  const auto run = [&] {
    for (std::uint64_t chunk = next++; chunk < chunks; chunk = next++) work(chunk);
  };
  std::vector<std::thread> others;
  try {
    for (unsigned i = 1; i < threads && i < chunks; ++i) others.emplace_back(run);
  } catch (const std::system_error&) {
    // No more threads to be had: those that run do the work.
  }
  run();
  for (std::thread& thread : others) thread.join();
}

}  // namespace vrpipe
