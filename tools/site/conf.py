"""Sphinx's settings for the site that tools/site/make builds."""
import os

import pygments.lexers

project = "filiform"
copyright = "the filiform developers, GPL-3.0-or-later"
release = os.environ["FILIFORM_SITE_VERSION"]
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "index"
html_theme = "furo"
html_title = f"filiform {release}"
html_show_sphinx = False
html_copy_source = False
html_static_path = [os.path.join(os.path.dirname(__file__), "style")]
html_css_files = ["narrow.css"]
html_extra_path = [os.environ["FILIFORM_SITE_EXTRA"]]
myst_heading_anchors = 4
breathe_projects = {"filiform": os.environ["FILIFORM_SITE_XML"]}
breathe_default_project = "filiform"
breathe_default_members = ("members",)
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_class_signature = "separated"
napoleon_google_docstring = False
breathe_domain_by_file_pattern = {"*/filiform.h": "c"}
c_id_attributes = ["FILIFORM_API"]
highlight_language = "text"
# Breathe declares a class again where a header names it before the one that defines it; pages quote fragments of programs.
suppress_warnings = ["duplicate_declaration.cpp", "duplicate_declaration.c", "misc.highlighting_failure", "myst.header"]


# Napoleon takes what is before a colon in the first line of a property as its type: its work is undone.
kept = {}


def keep(app, what, name, thing, options, lines):
    kept[name] = list(lines)
    section, written = False, []
    for line in lines:
        section = section or line.startswith("-----")
        if line and not line.startswith(" ") and written and not written[-1]:
            if section and " : " not in line:  # text after the parameters: a second empty line ends them
                written.append("")
                section = False
        elif line.startswith("    ") and what == "module" and not written[-1]:  # an example
            written += ["::", ""]
            what = "example"
        written.append(line)
    lines[:] = written


def put_back(app, what, name, thing, options, lines):
    if what == "property":
        lines[:] = kept[name]


def setup(app):
    app.connect("autodoc-process-docstring", keep, priority=400)
    app.connect("autodoc-process-docstring", put_back, priority=600)
    app.add_lexer("hex", pygments.lexers.TextLexer)
