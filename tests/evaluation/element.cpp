// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/element.h"

#include <algorithm>
#include <stdexcept>

namespace qdmd::evaluation {

namespace {

constexpr const char* kElement = "qdmdbackground";

std::string take_message(GError* error) {
  const std::string text = error ? error->message : "unknown error";
  g_clear_error(&error);
  return text;
}

GParamSpec* property_of(GstElement* element, const std::string& name) {
  return g_object_class_find_property(G_OBJECT_GET_CLASS(element), name.c_str());
}

}  // namespace

void load_plugin(const std::string& file) {
  GError* error = nullptr;
  const Ref<GstPlugin> plugin(gst_plugin_load_file(file.c_str(), &error));
  if (!plugin) throw std::runtime_error("cannot load " + file + ": " + take_message(error));
  const Ref<GstElementFactory> factory(gst_element_factory_find(kElement));
  if (!factory) throw std::runtime_error(file + " has no element " + kElement);
  const Ref<GstPlugin> owner(gst_plugin_feature_get_plugin(GST_PLUGIN_FEATURE(factory.get())));
  const gchar* used = owner ? gst_plugin_get_filename(owner.get()) : nullptr;
  if (!used || file != used)
    throw std::runtime_error(std::string(kElement) + " comes from " + (used ? used : "elsewhere") +
                             ", not from " + file);
}

Ref<GstElement> make_element() {
  GstElement* element = gst_element_factory_make(kElement, nullptr);
  if (!element) throw std::runtime_error(std::string("cannot make ") + kElement);
  return Ref<GstElement>(GST_ELEMENT(gst_object_ref_sink(element)));
}

std::vector<std::string> element_methods() {
  const Ref<GstElement> element = make_element();
  const GParamSpec* spec = property_of(element.get(), "method");
  if (!spec || !G_IS_PARAM_SPEC_ENUM(spec))
    throw std::runtime_error(std::string(kElement) + " has no enum property method");
  const GEnumClass* values = G_PARAM_SPEC_ENUM(spec)->enum_class;
  std::vector<std::string> names;
  for (guint i = 0; i < values->n_values; ++i) names.emplace_back(values->values[i].value_nick);
  return names;
}

std::pair<std::string, std::string> parse_property(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw std::invalid_argument("'" + text + "' is not name=value");
  const std::string name = text.substr(0, equals), value = text.substr(equals + 1);
  if (name == "method" || name == "output")
    throw std::invalid_argument("'" + name + "' is set by the program itself" +
                                (name == "method" ? ": use --methods" : ""));
  const Ref<GstElement> element = make_element();
  GParamSpec* spec = property_of(element.get(), name);
  if (!spec || !(spec->flags & G_PARAM_WRITABLE))
    throw std::invalid_argument(std::string(kElement) + " has no property '" + name +
                                "' that can be set");
  GValue parsed = G_VALUE_INIT;
  g_value_init(&parsed, spec->value_type);
  // Validation changes a value out of range.
  const bool good =
      gst_value_deserialize(&parsed, value.c_str()) && !g_param_value_validate(spec, &parsed);
  g_value_unset(&parsed);
  if (!good)
    throw std::invalid_argument("'" + value + "' is no value of the property '" + name + "' (see " +
                                "gst-inspect-1.0 " + kElement + ")");
  return {name, value};
}

void ElementOptions::apply(GstElement* element, const std::string& method, size_t frames) const {
  const auto* window = G_PARAM_SPEC_UINT(property_of(element, "window-size"));
  const auto count = static_cast<guint>(std::min<size_t>(frames, window->maximum));
  g_object_set(element, "window-size", std::max(count, window->minimum), "n-threads", threads,
               nullptr);
  for (const auto& [name, value] : properties)
    gst_util_set_object_arg(G_OBJECT(element), name.c_str(), value.c_str());
  gst_util_set_object_arg(G_OBJECT(element), "method", method.c_str());
}

}  // namespace qdmd::evaluation
