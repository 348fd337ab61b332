"""Reports: self-contained HTML pages, figures and tables."""
