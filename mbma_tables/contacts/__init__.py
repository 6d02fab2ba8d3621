"""Contacts: questions, their answers, quantities and laws."""
