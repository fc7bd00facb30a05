#include "jobs/processes.h"

#include <malloc.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/software.h>

#include "host/command_failure.h"
#include "host/crash_report.h"
#include "host/stdout_to_stderr.h"
#include "host/stopwatch.h"
#include "host/terminal.h"
#include "jobs/result_encoding.h"

namespace vrpipe::tools {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr int redraw_milliseconds = 100;

/// The first byte of what a worker sends.
enum Outcome : char { outcome_result = 'R', outcome_user_error = 'U', outcome_fault = 'F' };

/// Memory that forked processes share, for the progress of each.
class SharedProgress {
 public:
  explicit SharedProgress(std::size_t count) : count_(count) {
    void* const memory =
        ::mmap(nullptr, count * sizeof(std::atomic<float>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    values_ = static_cast<std::atomic<float>*>(memory);
    for (std::size_t i = 0; i < count; ++i) new (&values_[i]) std::atomic<float>(waiting);
  }
  ~SharedProgress() { ::munmap(static_cast<void*>(values_), count_ * sizeof(std::atomic<float>)); }
  SharedProgress(const SharedProgress&) = delete;
  SharedProgress& operator=(const SharedProgress&) = delete;

  std::atomic<float>& operator[](std::size_t index) { return values_[index]; }
  std::vector<float> now() const {
    std::vector<float> values;
    for (std::size_t i = 0; i < count_; ++i) values.push_back(values_[i].load(std::memory_order_relaxed));
    return values;
  }

 private:
  static_assert(std::atomic<float>::is_always_lock_free, "a lock would not work across processes");
  std::size_t count_;
  std::atomic<float>* values_;
};

/// Draws the progress of one simulation of this process from a thread of its own.
class ProgressThread {
 public:
  ProgressThread(const std::string& name, const std::atomic<float>& done, ProgressLine& line) {
    if (!line.visible()) return;
    const auto draw = [this, name, &done, &line] {
      const SteadyClock::time_point start = SteadyClock::now();
      std::unique_lock<std::mutex> lock(mutex_);
      while (!ended_.wait_for(lock, std::chrono::milliseconds(redraw_milliseconds), [this] { return stop_; })) {
        line.show(
            progress_text({name}, {done.load(std::memory_order_relaxed)}, seconds_since(start), stderr_width() - 1));
      }
    };
    try {
      thread_ = std::thread(draw);
    } catch (const std::system_error&) {
      // No more threads to be had: no progress to be seen.
    }
  }
  ~ProgressThread() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stop_ = true;
    }
    ended_.notify_all();
    thread_.join();
  }
  ProgressThread(const ProgressThread&) = delete;
  ProgressThread& operator=(const ProgressThread&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool stop_ = false;
  std::thread thread_;
};

[[noreturn]] void system_failure(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

/// A simulation in a process of its own. Ends it, if need be, when destroyed.
class Worker {
 public:
  Worker(std::size_t index, const Task& task) : index_(index), name_(task.name), request_(task.request) {}
  ~Worker() {
    if (process_ > 0) {
      ::kill(process_, SIGKILL);
      while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {}
    }
    if (pipe_ >= 0) ::close(pipe_);
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  std::size_t index() const { return index_; }
  int pipe() const { return pipe_; }

  void start(const Frame& frame, bool with_image, std::atomic<float>& progress) {
    if (with_image) image_.emplace(frame.width(), frame.height());
    int ends[2];
    if (::pipe(ends) != 0) system_failure("cannot open a pipe to a simulation");
    std::cout.flush();
    std::fflush(nullptr);
    const pid_t parent = ::getpid();
    process_ = ::fork();
    if (process_ < 0) {
      const int error = errno;
      ::close(ends[0]);
      ::close(ends[1]);
      errno = error;
      system_failure("cannot start a process for a simulation");
    }
    if (process_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (::getppid() != parent) ::_exit(exit_fault);
      ::close(ends[0]);
      work(ends[1], frame, image_ ? &*image_ : nullptr, progress);
    }
    ::close(ends[1]);
    pipe_ = ends[0];
  }

  /// Takes what the process has sent; true once it has sent all.
  bool receive() {
    char buffer[65536];
    const ssize_t count = ::read(pipe_, buffer, sizeof buffer);
    if (count < 0) {
      if (errno == EINTR) return false;
      system_failure("cannot read a simulation's result");
    }
    received_.append(buffer, static_cast<std::size_t>(count));
    return count == 0;
  }

  /// The result, once all of it is here. Throws CommandFailure.
  Simulated finish() {
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {}
    process_ = -1;
    if (WIFSIGNALED(status)) {
      const int signal = WTERMSIG(status);
      const std::string how = fmt::format("its process was ended by signal {} ({})", signal, ::strsignal(signal));
      if (signal == SIGKILL) fail(how + "; if memory ran out, try --jobs 1 or a smaller --size");
      const bool is_from_outside = signal == SIGTERM || signal == SIGINT || signal == SIGHUP;
      is_from_outside ? fail(how) : fault(how);
    }
    if (received_.empty() || WEXITSTATUS(status) != 0) {
      fail(fmt::format("its process ended with code {} before it was done", WEXITSTATUS(status)));
    }
    const std::string content = received_.substr(1);
    if (received_[0] == outcome_user_error) throw CommandFailure(exit_user_error, content);
    if (received_[0] != outcome_result) content == out_of_memory ? fail(content) : fault(content);
    Simulated simulated;
    try {
      simulated.result = from_bytes(content, request_);
    } catch (const std::runtime_error& error) {
      fail(error.what());
    }
    simulated.image = std::move(image_);
    return simulated;
  }

 private:
  /// For a reason of its own; for another it may be well the next time.
  [[noreturn]] void fault(const std::string& text) const { throw SimulationFailure(said_of_it(text)); }
  [[noreturn]] void fail(const std::string& text) const { throw CommandFailure(exit_fault, said_of_it(text)); }
  std::string said_of_it(const std::string& text) const {
    const std::string& name = name_of(request_);
    return "variant " + name + (name_ == name ? "" : ", " + name_) + ": " + text;
  }

  [[noreturn]] void work(int out, const Frame& frame, SharedImage* image, std::atomic<float>& progress) const {
    ::dup2(STDERR_FILENO, STDOUT_FILENO);
    if (!loaded_plugins().empty()) report_crashes_to(out, outcome_fault);
    std::string message;
    try {
      const RunResult result = simulate(of_variant_alone(request_), frame, &progress);
      if (image != nullptr) image->copy_from(result.framebuffer.color);
      message = char{outcome_result} + to_bytes(result);
    } catch (const UserError& error) {
      message = char{outcome_user_error} + std::string(error.what());
    } catch (const std::bad_alloc&) {
      message = char{outcome_fault} + std::string(out_of_memory);
    } catch (const std::exception& fault) {
      message = char{outcome_fault} + std::string(fault.what());
    } catch (...) {
      message = char{outcome_fault} + std::string("an exception of unknown type");
    }
    std::cout.flush();
    std::fflush(nullptr);
    std::size_t sent = 0;
    while (sent < message.size()) {
      const ssize_t count = ::write(out, message.data() + sent, message.size() - sent);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) ::_exit(exit_fault);
      sent += static_cast<std::size_t>(count);
    }
    // Not exit(): what the parent registered to happen at its end is not this process's business.
    ::_exit(0);
  }

  std::size_t index_;
  const std::string& name_;
  const RunRequest& request_;
  std::optional<SharedImage> image_;
  pid_t process_ = -1;
  int pipe_ = -1;
  std::string received_;
};

}  // namespace

Simulated simulate_here(const RunRequest& request, const Frame& frame, bool with_image, ProgressLine& progress) {
  Simulated simulated;
  {
    const StdoutToStderr redirected;
    std::atomic<float> done{0.0F};
    const ProgressThread drawing(name_of(request), done, progress);
    if (!loaded_plugins().empty()) report_crashes("variant " + name_of(request) + ": ");
    simulated.result = simulate(of_variant_alone(request), frame, &done);
    simulated.result.request = as_taken(request, simulated.result.way);
  }
  progress.erase();
  if (with_image) {
    simulated.image.emplace(frame.width(), frame.height());
    simulated.image->copy_from(simulated.result.framebuffer.color);
  }
  simulated.result.framebuffer.color = ColorSurface(1, 1, request.format);
  simulated.result.framebuffer.depth_stencil = DepthStencilSurface(1, 1);
  return simulated;
}

void run_tasks(const std::vector<Task>& tasks, bool with_images, unsigned processes, const BatchPlace& place,
               ProgressLine& progress, const std::function<void(std::size_t index, Simulated&& simulated)>& finished) {
  const SteadyClock::time_point start = SteadyClock::now();
  SharedProgress done(tasks.size());
  std::vector<std::string> names(place.before);
  for (const Task& task : tasks) names.push_back(task.name);
  names.resize(names.size() + place.after);

#ifdef __GLIBC__
  // Configurations that were checked leave holes in the heap, where L2s were: every fork would copy their page tables.
  ::malloc_trim(0);
#endif
  std::vector<std::unique_ptr<Worker>> workers;
  std::size_t next = 0;
  while (next < tasks.size() || !workers.empty()) {
    while (next < tasks.size() && workers.size() < processes) {
      const std::shared_ptr<const Frame> frame = tasks[next].frame(tasks[next].request);
      auto worker = std::make_unique<Worker>(next, tasks[next]);
      done[next] = 0.0F;
      try {
        worker->start(*frame, with_images, done[next]);
      } catch (const std::system_error&) {
        if (workers.empty()) throw;
        processes = static_cast<unsigned>(workers.size());  // the system gives no more at a time
        break;
      }
      workers.push_back(std::move(worker));
      ++next;
    }
    std::vector<pollfd> pipes;
    for (const auto& worker : workers) pipes.push_back({worker->pipe(), POLLIN, 0});
    const bool wakes = progress.visible() || place.meanwhile != nullptr;
    if (::poll(pipes.data(), pipes.size(), wakes ? redraw_milliseconds : -1) < 0 && errno != EINTR) {
      system_failure("cannot wait for the simulations");
    }
    if (place.meanwhile) place.meanwhile();
    for (std::size_t i = pipes.size(); i-- > 0;) {
      if (pipes[i].revents == 0 || !workers[i]->receive()) continue;
      const std::size_t index = workers[i]->index();
      std::optional<Simulated> simulated;
      std::string fault;
      try {
        simulated = workers[i]->finish();
      } catch (const SimulationFailure& failure) {
        if (!place.failed) throw;
        fault = failure.what();
      }
      workers.erase(workers.begin() + static_cast<std::ptrdiff_t>(i));
      done[index] = 1.0F;
      simulated ? finished(index, std::move(*simulated)) : place.failed(index, fault);
    }
    std::vector<float> all(place.before, 1.0F);
    const std::vector<float> these = done.now();
    all.insert(all.end(), these.begin(), these.end());
    all.resize(all.size() + place.after, waiting);
    const unsigned width = stderr_width();
    const auto room = static_cast<unsigned>(width - std::min<std::size_t>(width, place.title.size() + 1));
    progress.show(place.title + progress_text(names, all, place.seconds_before + seconds_since(start), room));
  }
  progress.erase();
}

std::vector<Simulated> simulate_in_processes(const std::vector<RunRequest>& requests, const FrameSource& frame,
                                             bool with_images, unsigned processes, ProgressLine& progress) {
  std::vector<Task> tasks;
  for (const RunRequest& request : requests) tasks.push_back({name_of(request), request, frame});
  std::vector<Simulated> results(requests.size());
  run_tasks(tasks, with_images, processes, {}, progress,
            [&](std::size_t index, Simulated&& simulated) { results[index] = std::move(simulated); });
  return results;
}

}  // namespace vrpipe::tools
