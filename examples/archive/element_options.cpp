// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/element_options.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "examples/archive/gst_pointers.h"
#include "gst/gstqdmdseparate.h"

namespace qdmd::archive {
namespace {

// What is told to applications while a stream runs, and what depends on time.
constexpr const char* kLeftOut[] = {"name",
                                    "parent",
                                    "post-messages",
                                    "spectrum",
                                    "regions",
                                    "regions-min-area",
                                    "freeze",
                                    "time-budget",
                                    "ignore-roi-type",
                                    "object-messages",
                                    "object-snapshots",
                                    "object-min-size",
                                    "object-appear-time",
                                    "object-stop-time",
                                    "object-gone-time",
                                    "motion-end-time",
                                    "mask-scale"};

// As an application makes one, which elements ask for their name.
ElementPtr new_element() {
  static const bool known = GST_ELEMENT_REGISTER(qdmdseparate, nullptr);
  GstElement* const element = known ? gst_element_factory_make("qdmdseparate", nullptr) : nullptr;
  if (!element) throw std::runtime_error("qdmdseparate cannot be made");
  return ElementPtr(GST_ELEMENT(gst_object_ref_sink(element)));
}

std::string text_of(const GValue* value) {
  const CharsPtr text(gst_value_serialize(value));
  return text ? text.get() : "";
}

}  // namespace

std::vector<ElementOption> element_options() {
  const ElementPtr element = new_element();
  guint count = 0;
  GParamSpec** const specs =
      g_object_class_list_properties(G_OBJECT_GET_CLASS(element.get()), &count);
  std::vector<ElementOption> options;
  for (GParamSpec* const spec : std::vector(specs, specs + count)) {
    const std::string name = g_param_spec_get_name(spec);
    const auto* const end = std::end(kLeftOut);
    if (!(spec->flags & G_PARAM_WRITABLE) || std::find(std::begin(kLeftOut), end, name) != end)
      continue;
    options.push_back(
        {name, g_param_spec_get_blurb(spec), text_of(g_param_spec_get_default_value(spec))});
  }
  g_free(specs);
  return options;
}

void set_option(GstElement* element, const std::string& name, const std::string& value) {
  GParamSpec* const spec = g_object_class_find_property(G_OBJECT_GET_CLASS(element), name.c_str());
  GValue set = G_VALUE_INIT;
  g_value_init(&set, spec->value_type);
  const bool is_value = gst_value_deserialize(&set, value.c_str()) != FALSE;
  // A value that the property has to change is none of its own.
  const bool suits = is_value && !g_param_value_validate(spec, &set);
  if (suits) g_object_set_property(G_OBJECT(element), name.c_str(), &set);
  g_value_unset(&set);
  if (suits) return;
  std::string message = "--" + name + " has no value " + value;
  if (const auto* const kinds =
          G_IS_PARAM_SPEC_ENUM(spec) ? G_PARAM_SPEC_ENUM(spec)->enum_class : nullptr)
    for (guint i = 0; i < kinds->n_values; ++i)
      message += (i == 0                    ? ": it is "
                  : i + 1 < kinds->n_values ? ", "
                                            : " or ") +
                 std::string(kinds->values[i].value_nick);
  throw std::invalid_argument(message);
}

GstElement* make_element(const std::map<std::string, std::string>& values) {
  ElementPtr element = new_element();
  for (const auto& [name, value] : values) set_option(element.get(), name, value);
  return element.release();
}

}  // namespace qdmd::archive
