"""stub"""
class ContactState: pass
class Ledger: pass
def contacts_of(*a): pass
def ledger_of(*a): pass
