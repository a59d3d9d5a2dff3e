// SPDX-License-Identifier: LGPL-2.1-or-later
// Memory that runs out while something is saved or loaded: all is as it was, and no frame is lost.
#include "core/model/learnt_file.h"

#include <functional>
#include <new>

#include "tests/core/allocator.h"
#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 32, kHeight = 24;

void push(Engine& engine, int t, bool pop = true) {
  PackedPicture picture(kWidth, kHeight);
  for (size_t c = 0; c < 3; ++c)
    for (size_t p = 0; p < picture.pixels(); ++p)
      picture.at(c, p) = static_cast<uint8_t>(
          p / 40 == static_cast<size_t>(t) % 19 ? 240 : 40 + (7 * p + 11 * c) % 50);
  ASSERT_TRUE(engine.push(picture.in()).ok());
  if (!pop) return;
  while (engine.next()) engine.next()->pop(Output::background, picture.out());
}

struct Case {
  Mode mode;
  Method method;
  int before, after;  // frames that the engine that loads has had, and in all
};

// Calls `action` with ever later allocations that fail, until none does.
void until_it_succeeds(const std::function<void()>& action, const std::function<void()>& after) {
  for (int64_t n = 1;; ++n) {
    ASSERT_LT(n, 1000);
    bool thrown = false;
    allocator::start();
    allocator::fail(n, allocator::Failing::all);
    try {
      action();
    } catch (const std::bad_alloc&) {
      thrown = true;
    }
    allocator::fail_no_more();
    const bool failed = allocator::seen().failed > 0;
    allocator::stop();
    ASSERT_EQ(failed, thrown);
    if (!failed) {
      EXPECT_GT(n, 1);
      return;
    }
    after();
  }
}

std::vector<uint8_t> saved(Engine& engine) {
  Learnt learnt;
  return engine.learnt(&learnt) ? pack(learnt) : std::vector<uint8_t>();
}

// What a file has without what is known of places.
std::vector<uint8_t> without_places(const std::vector<uint8_t>& file) {
  Learnt learnt;
  EXPECT_TRUE(unpack(file, &learnt).ok());
  if (learnt.earlier) learnt.earlier->places.clear();
  return pack(learnt);
}

TEST(LearntMemory, WhereThereIsNoneAllIsAsItWas) {
  for (const Case& c : {Case{Mode::live, Method::robust, 0, 20},
                        {Mode::live, Method::robust, 30, 50},
                        {Mode::live, Method::qdmd, 30, 50},
                        {Mode::batch, Method::robust, 0, 20},
                        {Mode::batch, Method::robust, 5, 20},
                        {Mode::batch, Method::robust, 30, 50},
                        {Mode::batch, Method::dmd, 30, 50}}) {
    EngineOptions options;
    options.mode = c.mode;
    options.method = c.method;
    options.window_size = 8;
    options.threads = 1;
    Engine teacher;
    ASSERT_TRUE(teacher.configure(options, kWidth, kHeight).ok());
    for (int t = 0; t < 40; ++t) push(teacher, t);
    std::vector<uint8_t> file;
    until_it_succeeds(
        [&] {
          Learnt learnt;
          ASSERT_TRUE(teacher.learnt(&learnt));
          file = pack(learnt);
        },
        [&] { EXPECT_FALSE(teacher.next()); });

    Engine engine;
    ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
    for (int t = 0; t < c.before; ++t) push(engine, t);
    const auto before = saved(engine);
    const int pending = engine.report().pending;
    EXPECT_EQ(c.before < (c.mode == Mode::batch ? 8 : 1), before.empty());
    Learnt learnt;
    until_it_succeeds(
        [&] {
          ASSERT_TRUE(unpack(file, &learnt).ok());
          ASSERT_TRUE(engine.learn_from(learnt).ok());
        },
        [&] {
          ASSERT_EQ(before, saved(engine));
          ASSERT_EQ(pending, engine.report().pending);
        });
    EXPECT_EQ(pending, engine.report().pending);
    if (pending == 0) {
      EXPECT_EQ(without_places(file), without_places(saved(engine)));
      // Frames that it has had say more of them.
      if (c.before == 0) {
        EXPECT_EQ(file, saved(engine));
      }
    }
    for (int t = c.before; t < c.after; ++t) push(engine, t);
    ASSERT_TRUE(engine.drain().ok());
  }
}

}  // namespace
}  // namespace qdmd::test
