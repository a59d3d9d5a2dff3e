# SPDX-License-Identifier: LGPL-2.1-or-later
"""Prints the reference part of docs/element.md: what the elements say of themselves.

Usage: element_page.py    (GST_PLUGIN_PATH names the folder of the plugins)
"""
import re
import sys

import gi

gi.require_version('Gst', '1.0')
from gi.repository import GObject, Gst

ELEMENTS = ['qdmdbackground', 'qdmdseparate', 'qdmdscenesrc']
# Elements that have another one's properties and signals, but for some.
# The page is the same with each version of GStreamer that the project builds with.
OF_NEWER_BASE_CLASSES = ('automatic-eos',)
LIKE = {'qdmdseparate': ('qdmdbackground', ['output'])}
PLAIN_NAMES = {'gboolean': 'boolean', 'guint': 'uint', 'gint': 'int', 'guint64': 'uint64',
               'gdouble': 'double', 'gchararray': 'string', 'GstStructure': 'structure',
               'GstSample': 'sample', 'GstValueArray': 'array'}
# Ends of a type's own range say nothing about the property.
ENDS = {'guint': 2**31 - 1, 'gint': 2**31 - 1, 'guint64': 2**64 - 1, 'gdouble': sys.float_info.max}


def cell(text):
    return text.replace('|', '\\|').replace('\n', ' ')


def number(value):
    return f'{value:g}' if isinstance(value, float) else str(value)


def values_of(spec):
    """{number: value} of an enum property."""
    kind = spec.enum_class
    if hasattr(kind, '__enum_values__'):
        return kind.__enum_values__
    # Newer bindings have GLib's class.
    values = {number: GObject.enum_get_value(kind, number) for number in range(kind.minimum, kind.maximum + 1)}
    return {number: value for number, value in values.items() if value}


def default_of(spec):
    if not spec.flags & GObject.ParamFlags.WRITABLE:
        return ''
    if spec.value_type.name == 'GstValueArray':
        return 'empty'
    if spec.value_type.is_a(GObject.TYPE_ENUM):
        return f'`{values_of(spec)[int(spec.default_value)].value_nick}`'
    if spec.value_type.name == 'gboolean':
        return 'true' if spec.default_value else 'false'
    if spec.value_type.name == 'gchararray':
        return f'`{spec.default_value}`' if spec.default_value else 'empty'
    return number(spec.default_value)


def range_of(spec):
    if spec.value_type.name not in ENDS:
        return ''
    if spec.maximum >= ENDS[spec.value_type.name]:
        return f'{number(spec.minimum)} or more'
    return f'{number(spec.minimum)} to {number(spec.maximum)}'


def changeable(spec):
    flags = int(spec.flags)
    if not flags & int(GObject.ParamFlags.WRITABLE):
        return 'read-only'
    if flags & Gst.PARAM_MUTABLE_PLAYING:
        return 'any state' + (', by controllers' if flags & Gst.PARAM_CONTROLLABLE else '')
    if flags & Gst.PARAM_MUTABLE_PAUSED:
        return 'NULL to PAUSED'
    if flags & Gst.PARAM_MUTABLE_READY:
        return 'NULL, READY'
    return 'unspecified'


def type_of(spec):
    if spec.value_type.is_a(GObject.TYPE_ENUM):
        return 'enum'
    return PLAIN_NAMES.get(spec.value_type.name, spec.value_type.name)


def print_pads(factory):
    print('| pad | presence | caps |\n|---|---|---|')
    for pad in sorted(factory.get_static_pad_templates(), key=lambda pad: pad.name_template):
        caps = re.sub(r'\((string|int|fraction)\)', '', pad.get_caps().to_string())
        print(f'| `{pad.name_template}` | {pad.presence.value_nick} | `{cell(caps)}` |')
    print()


def print_properties(own):
    print('| property | type | default | range | changeable in | meaning |\n|---|---|---|---|---|---|')
    for spec in own:
        print(f'| `{spec.name}` | {type_of(spec)} | {default_of(spec)} | {range_of(spec)} '
              f'| {changeable(spec)} | {cell(spec.blurb)} |')
    print()
    for spec in own:
        if not spec.value_type.is_a(GObject.TYPE_ENUM):
            continue
        print(f'Values of `{spec.name}`:\n\n| value | number | meaning |\n|---|---|---|')
        for value, entry in sorted(values_of(spec).items()):
            print(f'| `{entry.value_nick}` | {value} | {cell(entry.value_name)} |')
        print()


def print_signals(kind):
    for name in GObject.signal_list_names(kind):
        query = GObject.signal_query(name, kind)
        action = query.signal_flags & GObject.SignalFlags.ACTION
        parameters = ', '.join(parameter.name for parameter in query.param_types) or 'none'
        returns = 'nothing' if query.return_type.name == 'void' else query.return_type.name
        print(f'{"Action signal" if action else "Signal"} `{name}`: parameters {parameters}, '
              f'returns {returns}.\n')


def load(name):
    factory = Gst.ElementFactory.find(name)
    if not factory:
        sys.exit(f'there is no {name}: does GST_PLUGIN_PATH name the folder of the plugins?')
    return factory.load()


def said_of(name):
    """{name of a property or signal: what is said of it}"""
    kind = load(name).get_element_type()
    said = {spec.name: (spec.value_type, spec.blurb, default_of(spec), range_of(spec),
                        changeable(spec))
            for spec in GObject.list_properties(kind) if spec.owner_type == kind}
    for signal in GObject.signal_list_names(kind):
        query = GObject.signal_query(signal, kind)
        said[signal] = (query.return_type, query.param_types)
    return said


def print_likeness(name):
    other, without = LIKE[name]
    own, its = said_of(name), said_of(other)
    if own != {key: said for key, said in its.items() if key not in without}:
        sys.exit(f'{name} is not {other} without {without}: take it out of LIKE')
    print(f'Properties and signals: those of [{other}](#{other}), without '
          f'{", ".join(f"`{word}`" for word in without)}.\n')


def print_element(name):
    factory = load(name)
    kind = factory.get_element_type()
    properties = GObject.list_properties(kind)
    own = [spec for spec in properties if spec.owner_type == kind]
    inherited = [spec.name for spec in properties
                 if spec.owner_type != kind and spec.name not in OF_NEWER_BASE_CLASSES]
    print(f'## {name}\n')
    print(f'{factory.get_metadata("description")}.\n')
    print(f'Klass `{factory.get_metadata("klass")}`, rank {factory.get_rank()}, '
          f'in `{factory.get_plugin_name()}`.\n')
    print_pads(factory)
    if name in LIKE:
        print_likeness(name)
        return
    print_properties(own)
    print(f'Of its base classes: {", ".join(f"`{name}`" for name in inherited)}.\n')
    print_signals(kind)


Gst.init(None)
for element in ELEMENTS:
    print_element(element)
