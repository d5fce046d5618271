"""Logs, summaries and pictures of what was planned and done."""
