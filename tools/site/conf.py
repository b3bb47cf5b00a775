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
html_static_path = []
myst_enable_extensions = ["html_image"]
myst_heading_anchors = 4
breathe_projects = {"filiform": os.environ["FILIFORM_SITE_XML"]}
breathe_default_project = "filiform"
breathe_default_members = ("members",)
autodoc_member_order = "bysource"
autodoc_typehints = "description"
napoleon_google_docstring = False
cpp_id_attributes = ["FILIFORM_API"]
c_id_attributes = ["FILIFORM_API"]
highlight_language = "text"
# Breathe declares a class again where a header names it before the one that defines it; pages quote fragments of programs.
suppress_warnings = ["duplicate_declaration.cpp", "duplicate_declaration.c", "misc.highlighting_failure", "myst.header"]


def setup(app):
    app.add_lexer("hex", pygments.lexers.TextLexer)
