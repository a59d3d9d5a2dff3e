// A team whose members are threads: what MPI is to qdmd-archive.
#pragma once

#include <barrier>
#include <cstring>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "core/parallel/team.h"

namespace qdmd::test {

// Where members meet.
struct Hub {
  explicit Hub(int size) : meeting(size), parts(static_cast<size_t>(size)) {}

  std::barrier<> meeting;
  std::vector<void*> parts;
};

class ThreadTeam : public Team {
 public:
  ThreadTeam(Hub* hub, int rank) : hub_(hub), rank_(rank) {}
  int size() const override { return static_cast<int>(hub_->parts.size()); }
  int rank() const override { return rank_; }

  void sum(Talk about, std::span<int64_t> values) override {
    count(about, values.size_bytes());
    show(values.data());
    std::vector<int64_t> sums(values.size());
    for (const void* part : hub_->parts)
      for (size_t i = 0; i < sums.size(); ++i) sums[i] += static_cast<const int64_t*>(part)[i];
    hub_->meeting.arrive_and_wait();
    std::copy(sums.begin(), sums.end(), values.begin());
  }
  void share(Talk about, std::span<std::byte> all, std::span<const size_t> ends) override {
    count(about, all.size_bytes());
    show(all.data());
    for (size_t r = 0; r < ends.size(); ++r) {
      const size_t begin = r > 0 ? ends[r - 1] : 0;
      if (r != static_cast<size_t>(rank_))
        std::memcpy(all.data() + begin, static_cast<std::byte*>(hub_->parts[r]) + begin,
                    ends[r] - begin);
    }
    hub_->meeting.arrive_and_wait();
  }

  // Bytes that were talked about, by Talk.
  uint64_t bytes(Talk about) const { return bytes_[static_cast<size_t>(about)]; }

 private:
  void count(Talk about, size_t bytes) { bytes_[static_cast<size_t>(about)] += bytes; }
  void show(void* part) {
    hub_->parts[static_cast<size_t>(rank_)] = part;
    hub_->meeting.arrive_and_wait();
  }

  Hub* hub_;
  int rank_;
  uint64_t bytes_[kTalks] = {};
};

// Runs work(team) on `size` threads.
inline void run_team(int size, const std::function<void(ThreadTeam*)>& work) {
  Hub hub(size);
  std::vector<std::thread> threads;
  for (int rank = 0; rank < size; ++rank)
    threads.emplace_back([&hub, &work, rank] {
      ThreadTeam team(&hub, rank);
      work(&team);
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace qdmd::test
