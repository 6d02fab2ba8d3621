"""Closed forms: fitted to exact solves, certified, written."""
