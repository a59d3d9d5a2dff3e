// A team whose members are the processes of an MPI job, and the pictures that they gather.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/parallel/team.h"

namespace qdmd::archive {

// What pictures, and the pace of frames, are to the report beside the core's own talks.
enum class Traffic { products, light, cells, statistics, textures, masks, pictures, pace };
inline constexpr size_t kTraffic = 8;
const char* name_of(Traffic traffic);

// Each process has one thread that talks. A process that ends early ends the job: MPI sees to that.
class MpiTeam : public Team {
 public:
  // Throws std::runtime_error where this is no MPI job that can talk.
  MpiTeam(int* argc, char*** argv);
  ~MpiTeam() override;
  MpiTeam(const MpiTeam&) = delete;
  MpiTeam& operator=(const MpiTeam&) = delete;

  // True where the process was started by mpirun, srun or the like.
  static bool is_job();

  int size() const override { return size_; }
  int rank() const override { return rank_; }
  void sum(Talk about, std::span<int64_t> values) override;
  void share(Talk about, std::span<std::byte> all, std::span<const size_t> ends) override;

  // Whether all members found something alike: 0 none, 1 some, 2 all.
  int agree(bool one);
  // Whether all members have a frame; throws std::runtime_error where only some do: they do not
  // read the same.
  bool all_have(bool one);
  // The first member's values at all.
  void tell(std::span<int64_t> values);
  // The first member gets all parts one after another, member r's up to ends[r], into `all`; that
  // of the others may be empty.
  void gather(std::span<const uint8_t> own, std::span<uint8_t> all, std::span<const size_t> ends);
  // All members' values at the first member, in their order.
  std::vector<double> collect(double value) const;
  void wait_for_all() const;
  // Ends all processes of the job, this one included.
  [[noreturn]] static void abort();

  // Bytes that this process has taken in.
  uint64_t received(Traffic traffic) const { return received_[static_cast<size_t>(traffic)]; }
  // Seconds that it has talked, or waited for others to.
  double seconds() const { return seconds_; }
  // The seconds of those that it spent on a processor: MPI asks again and again whether others have
  // come.
  double processor_seconds() const { return processor_seconds_; }

 private:
  class Call;

  int size_ = 1, rank_ = 0;
  std::array<uint64_t, kTraffic> received_{};
  double seconds_ = 0, processor_seconds_ = 0;
};

}  // namespace qdmd::archive
