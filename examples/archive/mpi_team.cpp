#include "examples/archive/mpi_team.h"

#include <mpi.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <stdexcept>
#include <thread>

namespace qdmd::archive {
namespace {

// MPI counts in int.
constexpr size_t kMostBytes = size_t{1} << 30;

size_t part_begin(std::span<const size_t> ends, int rank) {
  return rank > 0 ? ends[static_cast<size_t>(rank) - 1] : 0;
}

}  // namespace

const char* name_of(Traffic traffic) {
  static constexpr const char* kNames[] = {"products", "light", "cells",    "statistics",
                                           "textures", "masks", "pictures", "pace"};
  static_assert(std::size(kNames) == kTraffic);
  return kNames[static_cast<size_t>(traffic)];
}

// One call: counts what it brings, and the time that it takes.
class MpiTeam::Call {
 public:
  Call(MpiTeam* team, Traffic traffic, size_t bytes)
      : team_(team), start_(MPI_Wtime()), processor_start_(processor_time()) {
    if (team->size_ > 1) team->received_[static_cast<size_t>(traffic)] += bytes;
  }
  ~Call() {
    team_->seconds_ += MPI_Wtime() - start_;
    team_->processor_seconds_ += processor_time() - processor_start_;
  }

 private:
  static double processor_time() {
    timespec time = {};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  MpiTeam* team_;
  double start_, processor_start_;
};

bool MpiTeam::is_job() {
  // What Open MPI sets, any PMIx (Slurm), and PMI (Slurm, MPICH).
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"})
    if (std::getenv(name)) return true;
  return false;
}

MpiTeam::MpiTeam(int* argc, char*** argv) {
  int provided = 0;
  // GStreamer's threads do not talk.
  if (MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &provided) != MPI_SUCCESS ||
      provided < MPI_THREAD_FUNNELED)
    throw std::runtime_error("this MPI cannot be used by a program with threads");
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
}

MpiTeam::~MpiTeam() { MPI_Finalize(); }

void MpiTeam::abort() {
  // What starters have not forwarded yet of what was said, they drop.
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  MPI_Abort(MPI_COMM_WORLD, 1);
  std::_Exit(1);
}

void MpiTeam::sum(Talk about, std::span<int64_t> values) {
  const Call call(this, static_cast<Traffic>(about), values.size_bytes());
  constexpr size_t kMost = kMostBytes / sizeof(int64_t);
  for (size_t at = 0; at < values.size(); at += kMost)
    MPI_Allreduce(MPI_IN_PLACE, values.data() + at,
                  static_cast<int>(std::min(kMost, values.size() - at)), MPI_INT64_T, MPI_SUM,
                  MPI_COMM_WORLD);
}

void MpiTeam::share(Talk about, std::span<std::byte> all, std::span<const size_t> ends) {
  const size_t own = ends[static_cast<size_t>(rank_)] - part_begin(ends, rank_);
  const Call call(this, static_cast<Traffic>(about), all.size_bytes() - own);
  if (all.size() > kMostBytes) throw std::runtime_error("pictures of that size cannot be shared");
  std::vector<int> counts, offsets;
  for (int rank = 0; rank < size_; ++rank) {
    offsets.push_back(static_cast<int>(part_begin(ends, rank)));
    counts.push_back(static_cast<int>(ends[static_cast<size_t>(rank)]) - offsets.back());
  }
  MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_BYTE, all.data(), counts.data(), offsets.data(), MPI_BYTE,
                 MPI_COMM_WORLD);
}

int MpiTeam::agree(bool one) {
  const Call call(this, Traffic::pace, sizeof(int));
  int count = one ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
  return count == 0 ? 0 : count == size_ ? 2 : 1;
}

bool MpiTeam::all_have(bool one) {
  const int have = agree(one);
  if (have == 1)
    throw std::runtime_error(one ? "another process has come to the end of the recording already: "
                                   "do all machines have the same files?"
                                 : "the recording ends here, and other processes have more of it: "
                                   "do all machines have the same files?");
  return have == 2;
}

void MpiTeam::tell(std::span<int64_t> values) {
  const Call call(this, Traffic::pace, rank_ == 0 ? 0 : values.size_bytes());
  MPI_Bcast(values.data(), static_cast<int>(values.size()), MPI_INT64_T, 0, MPI_COMM_WORLD);
}

void MpiTeam::gather(std::span<const uint8_t> own, std::span<uint8_t> all,
                     std::span<const size_t> ends) {
  const Call call(this, Traffic::pictures, rank_ == 0 ? ends.back() - own.size() : 0);
  if (ends.back() > kMostBytes)
    throw std::runtime_error("pictures of that size cannot be gathered");
  std::vector<int> counts, offsets;
  for (int rank = 0; rank < size_; ++rank) {
    offsets.push_back(static_cast<int>(part_begin(ends, rank)));
    counts.push_back(static_cast<int>(ends[static_cast<size_t>(rank)]) - offsets.back());
  }
  MPI_Gatherv(own.data(), static_cast<int>(own.size()), MPI_BYTE, all.data(), counts.data(),
              offsets.data(), MPI_BYTE, 0, MPI_COMM_WORLD);
}

std::vector<double> MpiTeam::collect(double value) const {
  std::vector<double> values(static_cast<size_t>(size_));
  MPI_Gather(&value, 1, MPI_DOUBLE, values.data(), 1, MPI_DOUBLE, 0, MPI_COMM_WORLD);
  return values;
}

void MpiTeam::wait_for_all() const { MPI_Barrier(MPI_COMM_WORLD); }

}  // namespace qdmd::archive
