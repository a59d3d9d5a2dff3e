// SPDX-License-Identifier: LGPL-2.1-or-later
// The library for Python: arrays in, arrays out. python/qdmd/__init__.py is what users see.
#include <pybind11/complex.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/dmd/decompose.h"
#include "core/gram/gram.h"
#include "core/library/separator.h"
#include "core/planes/window.h"

namespace py = pybind11;

namespace {

using qdmd::library::Layout;
using qdmd::library::Options;
using qdmd::library::Output;
using qdmd::library::Pixels;
using qdmd::library::Separator;

// A picture of Python's, which lives as long as this.
struct Picture {
  py::array array;
  Layout layout;
};

// An array (height, width) or (height, width, 1, 3 or 4) of uint8 or uint16. It is copied only
// where the samples of a pixel, or pixels of a row, do not lie side by side.
Picture picture_of(const py::object& object, int depth, bool blue_first) {
  if (!py::isinstance<py::array>(object)) throw py::type_error("a frame is a numpy array");
  auto array = py::reinterpret_borrow<py::array>(object);
  const bool deep = py::isinstance<py::array_t<uint16_t>>(array);
  if (!deep && !py::isinstance<py::array_t<uint8_t>>(array))
    throw py::type_error("a frame has samples of uint8 or uint16, not of " +
                         std::string(py::str(array.dtype())) + ": round them");
  const auto sides = array.ndim();
  const py::ssize_t channels = sides == 3 ? array.shape(2) : 1;
  if ((sides != 2 && sides != 3) || (channels != 1 && channels != 3 && channels != 4))
    throw py::value_error("a frame has the shape (height, width), or with 1, 3 or 4 channels");
  constexpr py::ssize_t kLongest = std::numeric_limits<int>::max();
  if (array.shape(0) < 1 || array.shape(1) < 1 || array.shape(0) > kLongest ||
      array.shape(1) > kLongest)
    throw py::value_error("a frame needs at least one pixel");
  const py::ssize_t size = array.itemsize(), pixel = channels * size;
  const bool even = array.strides(1) == pixel && (sides == 2 || array.strides(2) == size) &&
                    (array.shape(0) == 1 || std::abs(array.strides(0)) >= array.shape(1) * pixel);
  if (!even) array = py::array::ensure(array, py::array::c_style | py::array::forcecast);
  if (!array) throw py::error_already_set();
  Picture picture;
  picture.layout = {static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)),
                    array.shape(0) == 1 ? array.shape(1) * pixel : array.strides(0),
                    channels == 1   ? Pixels::grey
                    : channels == 3 ? (blue_first ? Pixels::bgr : Pixels::rgb)
                                    : (blue_first ? Pixels::bgra : Pixels::rgba),
                    deep ? depth : 8};
  if (deep && depth < 9) throw py::value_error("depth must be 9 to 16 bits for uint16");
  picture.array = std::move(array);
  return picture;
}

// A new one. channels 0: the shape has two sides.
Picture new_picture(const Layout& frames, Pixels pixels, int channels) {
  const bool deep = frames.depth > 8;
  std::vector<py::ssize_t> shape = {frames.height, frames.width};
  if (channels > 0) shape.push_back(channels);
  Picture picture;
  picture.array = deep ? py::array(py::dtype::of<uint16_t>(), shape)
                       : py::array(py::dtype::of<uint8_t>(), shape);
  picture.layout = {frames.width, frames.height, picture.array.strides(0), pixels, frames.depth};
  return picture;
}

Picture new_mask(Layout frames) {
  frames.depth = 8;
  return new_picture(frames, Pixels::grey, 0);
}

// The caller's memory for a mask of such frames.
Picture mask_in(const py::object& object, const Layout& frames) {
  if (!py::isinstance<py::array_t<uint8_t>>(object))
    throw py::type_error("mask is a numpy array of uint8");
  auto array = py::reinterpret_borrow<py::array>(object);
  if (array.ndim() != 2 || array.shape(0) != frames.height || array.shape(1) != frames.width)
    throw py::value_error("mask has the shape (height, width) of the frame");
  const py::ssize_t row = array.shape(0) == 1 ? array.shape(1) : array.strides(0);
  if (!array.writeable() || (array.strides(1) != 1 && array.shape(1) > 1) || row < array.shape(1))
    throw py::value_error("mask can be written to, and pixels of a row lie side by side");
  return {array, {frames.width, frames.height, row, Pixels::grey, 8}};
}

Output output_of(const std::string& name) {
  if (name == "background") return Output::background;
  if (name == "foreground") return Output::foreground;
  if (name == "mask") return Output::mask;
  if (name == "cutout") return Output::cutout;
  throw py::value_error("output is none of background, foreground, mask and cutout");
}

// Calls of other threads wait. Python goes on while a frame is worked on.
class Alone {
 protected:
  template <typename Action>
  auto alone(Action action) {
    const py::gil_scoped_release release;
    const std::lock_guard lock(mutex_);
    return action();
  }

 private:
  std::mutex mutex_;
};

class NativeSeparator : Alone {
 public:
  NativeSeparator(const Options& options, int depth, bool blue_first)
      : separator_(options), depth_(depth), blue_first_(blue_first) {
    if (depth < 9 || depth > 16) throw py::value_error("depth must be 9 to 16 bits");
  }

  py::array apply(const py::object& frame, const py::object& into) {
    const Picture picture = picture_of(frame, depth_, blue_first_);
    const Picture mask = into.is_none() ? new_mask(picture.layout) : mask_in(into, picture.layout);
    py::array array = mask.array;
    auto* const to = static_cast<uint8_t*>(array.mutable_data());
    alone(
        [&] { separator_.apply(picture.array.data(), picture.layout, to, mask.layout.row_bytes); });
    channels_ = shape_of(picture);
    return array;
  }
  void push(const py::object& frame) {
    const Picture picture = picture_of(frame, depth_, blue_first_);
    alone([&] { separator_.push(picture.array.data(), picture.layout); });
    channels_ = shape_of(picture);
  }
  bool ready() {
    return alone([&] { return separator_.ready(); });
  }
  py::array picture(const std::string& name) {
    const Output output = output_of(name);
    const Layout frames = alone([&] { return separator_.frames(); });
    Picture out = output == Output::mask ? new_mask(frames) : like_frames(frames);
    void* const to = out.array.mutable_data();
    alone([&] { separator_.write(output, out.layout, to); });
    return out.array;
  }
  py::list regions(int least_area) {
    const auto found = alone([&] { return separator_.regions(least_area); });
    py::list all;
    for (const auto& region : found)
      all.append(py::make_tuple(region.x, region.y, region.width, region.height, region.area,
                                region.mean_residual));
    return all;
  }
  void skip() {
    alone([&] { separator_.skip(); });
  }
  void drain() {
    alone([&] { separator_.drain(); });
  }
  py::object background() {
    const Layout frames = alone([&] { return separator_.frames(); });
    if (frames.width == 0) return py::none();
    Picture out = like_frames(frames);
    void* const to = out.array.mutable_data();
    const bool known = alone([&] { return separator_.background(out.layout, to); });
    return known ? py::object(out.array) : py::none();
  }
  void freeze(bool freeze) {
    alone([&] { separator_.freeze(freeze); });
  }
  void ignore(const std::vector<std::array<int, 4>>& areas) {
    std::vector<qdmd::library::Rectangle> rectangles;
    for (const auto& area : areas) rectangles.push_back({area[0], area[1], area[2], area[3]});
    alone([&] { separator_.ignore(rectangles); });
  }
  void reset() {
    alone([&] { separator_.reset(); });
  }
  void save(const std::string& file) {
    alone([&] { separator_.save(file); });
  }
  void load(const std::string& file) {
    alone([&] { separator_.load(file); });
  }

 private:
  // Channels as a frame's shape has them; 0: it has two sides.
  static int shape_of(const Picture& picture) {
    return picture.array.ndim() == 2 ? 0 : static_cast<int>(picture.array.shape(2));
  }
  // With the frames' channels; before the first frame, those of what was loaded.
  Picture like_frames(const Layout& frames) const {
    const bool grey = frames.pixels == Pixels::grey;
    int channels = channels_;
    if (channels < 0 || grey != (channels < 2)) channels = grey ? 0 : 3;
    const Pixels pixels = grey            ? Pixels::grey
                          : channels == 4 ? (blue_first_ ? Pixels::bgra : Pixels::rgba)
                          : blue_first_   ? Pixels::bgr
                                          : Pixels::rgb;
    return new_picture(frames, pixels, channels);
  }
  Separator separator_;
  int depth_;
  bool blue_first_;
  int channels_ = -1;
};

template <typename Enum>
Enum named(const py::dict& settings, const char* key, const std::vector<std::string>& names) {
  const auto name = settings[key].cast<std::string>();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    std::string all;
    for (const std::string& one : names) all += (all.empty() ? "" : ", ") + one;
    throw py::value_error(std::string(key) + " is '" + name + "' and must be one of " + all);
  }
  return static_cast<Enum>(found - names.begin());
}

Options options_of(const py::dict& settings) {
  namespace library = qdmd::library;
  Options options;
  options.mode = named<library::Mode>(settings, "mode", {"live", "batch"});
  options.method = named<library::Method>(settings, "method", {"robust", "qdmd", "dmd"});
  options.amplitude = named<library::Amplitude>(settings, "amplitude", {"window", "first-frame"});
  options.solver = named<library::Solver>(settings, "solver",
                                          {"gram", "gram-extended", "qr", "adjoint", "auto"});
  options.estimator = named<library::Estimator>(
      settings, "estimator", {"exact", "forward-backward", "total", "optimized"});
  options.stabilize =
      named<library::Stabilize>(settings, "stabilize", {"off", "translation", "similarity"});
  options.shadows =
      named<library::Shadows>(settings, "shadows", {"background", "foreground", "marked"});
  const auto set = [&](const char* key, auto* value) {
    *value = settings[key].cast<std::remove_pointer_t<decltype(value)>>();
  };
  set("window_size", &options.window_size);
  set("hop_size", &options.hop_size);
  set("rank", &options.rank);
  set("omega_threshold", &options.omega_threshold);
  set("sample_step", &options.sample_step);
  set("iterations", &options.iterations);
  set("stabilize_output", &options.stabilize_output);
  set("foreground_threshold", &options.foreground_threshold);
  set("mask_softness", &options.mask_softness);
  set("absorb_frames", &options.absorb_frames);
  set("frame_rate", &options.frame_rate);
  set("time_budget", &options.time_budget);
  set("mask_scale", &options.mask_scale);
  set("n_threads", &options.threads);
  set("max_memory", &options.max_memory);
  set("window_on_disk", &options.window_on_disk);
  for (const auto& area : settings["ignore"].cast<std::vector<std::array<int, 4>>>())
    options.ignore.push_back({area[0], area[1], area[2], area[3]});
  return options;
}

// A window of Python's frames; grey ones have three equal channels.
qdmd::Window window_of(const py::list& frames, int depth) {
  const Picture first = picture_of(frames[0], depth, false);
  const auto pixels =
      static_cast<size_t>(first.layout.width) * static_cast<size_t>(first.layout.height);
  qdmd::Window window(static_cast<int>(frames.size()), pixels, first.layout.depth);
  for (const auto& frame : frames) {
    const Picture picture = picture_of(py::reinterpret_borrow<py::object>(frame), depth, false);
    const Layout& layout = picture.layout;
    if (layout.width != first.layout.width || layout.height != first.layout.height ||
        layout.pixels != first.layout.pixels || layout.depth != first.layout.depth)
      throw py::value_error("all frames have one shape and one type");
    const size_t step = layout.pixels == Pixels::grey ? 1 : layout.pixels == Pixels::rgb ? 3 : 4;
    const int slot = window.append(), low = layout.depth - 8;
    for (int c = 0; c < qdmd::kChannels; ++c) {
      const qdmd::MutableSamples to = window.samples(slot, c);
      for (int y = 0; y < layout.height; ++y) {
        const auto* row = static_cast<const uint8_t*>(picture.array.data()) + y * layout.row_bytes;
        for (int x = 0; x < layout.width; ++x) {
          const size_t at =
              static_cast<size_t>(x) * step + (step == 1 ? 0 : static_cast<size_t>(c));
          const size_t p =
              static_cast<size_t>(y) * static_cast<size_t>(layout.width) + static_cast<size_t>(x);
          if (low == 0) {
            to.high[p] = row[at];
            continue;
          }
          const unsigned sample = reinterpret_cast<const uint16_t*>(row)[at];
          to.high[p] = static_cast<uint8_t>(sample >> low);
          to.low[p] = static_cast<uint8_t>(sample & ((1u << low) - 1));
        }
      }
    }
  }
  return window;
}

py::array_t<double> parts_of(const qdmd::QuaternionMatrixd& m) {
  py::array_t<double> parts({m.rows(), m.cols(), Eigen::Index{4}});
  auto to = parts.mutable_unchecked<3>();
  for (Eigen::Index r = 0; r < m.rows(); ++r)
    for (Eigen::Index c = 0; c < m.cols(); ++c) {
      const qdmd::Quaterniond q = m.get(r, c);
      to(r, c, 0) = q.w, to(r, c, 1) = q.x, to(r, c, 2) = q.y, to(r, c, 3) = q.z;
    }
  return parts;
}

py::array_t<double> array_of(const Eigen::MatrixXd& m) {
  py::array_t<double> array({m.rows(), m.cols()});
  auto to = array.mutable_unchecked<2>();
  for (Eigen::Index r = 0; r < m.rows(); ++r)
    for (Eigen::Index c = 0; c < m.cols(); ++c) to(r, c) = m(r, c);
  return array;
}

// L(t) as weights(t) basis W, where W has the window's planes (TemporalModel).
class NativeBackground {
 public:
  explicit NativeBackground(qdmd::TemporalModel model) : model_(std::move(model)) {}
  py::array_t<double> basis() const { return array_of(model_.basis()); }
  py::array_t<double> weights(double t) const { return array_of(model_.weights(t)); }

 private:
  qdmd::TemporalModel model_;
};

py::dict decompose(const py::list& frames, const py::dict& settings, int depth) {
  if (frames.empty()) throw py::value_error("give at least one frame");
  if (frames.size() > 2048) throw py::value_error("give 2048 frames at most");
  Options named_options = options_of(settings);
  qdmd::DmdOptions options;
  options.rank = named_options.rank;
  options.omega_threshold = named_options.omega_threshold;
  options.amplitude = static_cast<qdmd::Amplitude>(named_options.amplitude);
  options.solver = static_cast<qdmd::Solver>(named_options.solver);
  options.estimator = static_cast<qdmd::Estimator>(named_options.estimator);
  if (options.rank < 0 || !(options.omega_threshold >= 0))
    throw py::value_error("rank and omega_threshold must not be negative");
  const qdmd::Window window = window_of(frames, depth);
  qdmd::BackgroundModes all;
  qdmd::Decomposition background;
  {
    const py::gil_scoped_release release;
    qdmd::Pool pool(named_options.threads);
    const qdmd::SnapshotRange snapshots(window);
    qdmd::SlidingGram gram(window.capacity(), qdmd::ChromaShape{}, window.depth(), &pool);
    gram.add_newest(window, window.size());
    background = qdmd::decompose(snapshots, gram.matrix(snapshots), options);
    if (window.size() > 1) {
      options.omega_threshold = std::numeric_limits<double>::infinity();
      all = qdmd::quaternion_modes(snapshots, gram.matrix(snapshots), options);
    }
  }
  std::vector<std::complex<double>> eigenvalues(all.eigenvalues.begin(), all.eigenvalues.end());
  std::vector<double> times(all.reference_times.begin(), all.reference_times.end());
  const qdmd::DmdSummary& summary = background.summary;
  py::dict result;
  result["eigenvalues"] = py::array(py::cast(eigenvalues)).attr("astype")("complex128");
  result["reference_times"] = py::array(py::cast(times)).attr("astype")("float64");
  result["combination"] = parts_of(all.combination);
  result["amplitudes"] = parts_of(all.amplitudes);
  result["background_modes"] = summary.background_modes;
  result["rank"] = summary.rank;
  result["condition"] = summary.condition;
  result["converged"] = summary.converged;
  result["background"] = py::cast(NativeBackground(std::move(background.background)));
  return result;
}

}  // namespace

PYBIND11_MODULE(_native, module) {
  module.doc() = "What qdmd is made of. Use qdmd.";
  py::class_<NativeSeparator>(module, "Separator")
      .def(py::init([](const py::dict& settings, int depth, bool bgr) {
             return std::make_unique<NativeSeparator>(options_of(settings), depth, bgr);
           }),
           py::arg("settings"), py::arg("depth"), py::arg("bgr"))
      .def("apply", &NativeSeparator::apply, py::arg("frame"), py::arg("mask"))
      .def("push", &NativeSeparator::push, py::arg("frame"))
      .def("ready", &NativeSeparator::ready)
      .def("picture", &NativeSeparator::picture, py::arg("output"))
      .def("regions", &NativeSeparator::regions, py::arg("least_area"))
      .def("skip", &NativeSeparator::skip)
      .def("drain", &NativeSeparator::drain)
      .def("background", &NativeSeparator::background)
      .def("freeze", &NativeSeparator::freeze, py::arg("freeze"))
      .def("ignore", &NativeSeparator::ignore, py::arg("areas"))
      .def("reset", &NativeSeparator::reset)
      .def("save", &NativeSeparator::save, py::arg("file"))
      .def("load", &NativeSeparator::load, py::arg("file"));
  py::class_<NativeBackground>(module, "Background")
      .def("basis", &NativeBackground::basis)
      .def("weights", &NativeBackground::weights, py::arg("t"));
  module.def("decompose", &decompose, py::arg("frames"), py::arg("settings"), py::arg("depth"));
}
