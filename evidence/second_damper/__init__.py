"""The search for a damper that does at the second bending mode what the paper says of its second one."""
