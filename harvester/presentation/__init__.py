"""How results are shown: glossary, messages, text, JSON, tables and HTML, for any result."""
